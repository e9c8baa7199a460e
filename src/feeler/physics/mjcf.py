"""A scene as MJCF, for MuJoCo's own viewer."""

from pathlib import Path

from feeler.antenna.antenna import Antenna
from feeler.physics.engine import choose_timestep, get_engine
from feeler.physics.scene import make_scene
from feeler.physics.spec import make_spec
from feeler.stimulus.trial import Trial


def write_mjcf(antenna: Antenna, trial: Trial, path: Path, timestep: float | None = None) -> Path:
    """Write the trial's scene as MJCF in g, mm, ms; the keyframe ``start`` sets the object
    moving.
    """
    scene = make_scene(antenna, trial)
    spec = make_spec(scene, choose_timestep(timestep, "mujoco"))
    spec.comment = (
        "feeler scene in g, mm, ms (so N, N·mm, MPa): one second of the viewer's clock is one"
        " millisecond."
    )
    spec.stat.extent, spec.stat.center = antenna.length, [0.0, antenna.length / 2, 0.0]
    spec.compile()
    key = spec.add_key(name="start")
    if antenna.spatial:
        start = get_engine("mujoco").make([scene], spec.option.timestep)
        key.qpos, key.qvel = start.data.qpos.copy(), start.data.qvel.copy()  # type: ignore[attr-defined]
    else:
        key.qpos = [*scene.initial_angle, 0.0, 0.0, 0.0]
        key.qvel = [*scene.initial_velocity, *scene.objects[0].velocity, scene.objects[0].turn]
    spec.compile()
    path = Path(path)
    path.write_text(spec.to_xml())
    return path
