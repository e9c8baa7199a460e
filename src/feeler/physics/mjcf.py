"""A scene as MJCF: for MuJoCo's own viewer, or for control of the antenna."""

from pathlib import Path

from feeler.antenna.antenna import Antenna
from feeler.disk.files import writing
from feeler.errors import InvalidInput
from feeler.physics.engine import choose_timestep, get_engine
from feeler.physics.scene import make_scene
from feeler.physics.spec import make_spec
from feeler.physics.spec_control import SERVOS, add_control
from feeler.stimulus.trial import Trial


def write_mjcf(
    antenna: Antenna,
    trial: Trial,
    path: Path,
    timestep: float | None = None,
    *,
    control: bool = False,
) -> Path:
    """Write the trial's scene as MJCF in g, mm, ms; the keyframe ``start`` sets the object
    moving.

    Parameters
    ----------
    control
        A model to be controlled: the base hangs on three joints with position actuators, the
        objects are mocap bodies (they stand where ``mocap_pos`` puts them), and each sensor gives
        its hinge's angle and velocity and the force of touch on its segment.

    Raises
    ------
    InvalidInput
        ``control`` of an antenna that bends in space.
    """
    scene = make_scene(antenna, trial)
    if control and antenna.spatial:
        raise InvalidInput("control=True is for antennas that bend in one plane.")
    spec = make_spec(scene, choose_timestep(timestep, "mujoco", scene.contact), moving=control)
    spec.comment = (
        "feeler scene in g, mm, ms (so N, N·mm, MPa): one second of the viewer's clock is one"
        " millisecond."
    )
    spec.stat.extent, spec.stat.center = antenna.length, [0.0, antenna.length / 2, 0.0]
    if control:
        add_control(spec, scene)
    spec.compile()
    key = spec.add_key(name="start")
    if antenna.spatial:
        start = get_engine("mujoco").make([scene], spec.option.timestep)
        key.qpos, key.qvel = start.data.qpos.copy(), start.data.qvel.copy()  # type: ignore[attr-defined]
    elif control:
        key.qpos = [0.0] * len(SERVOS) + [*scene.initial_angle]
        key.ctrl = [0.0] * len(SERVOS)
    else:
        key.qpos = [*scene.initial_angle, 0.0, 0.0, 0.0]
        key.qvel = [*scene.initial_velocity, *scene.objects[0].velocity, scene.objects[0].turn]
    spec.compile()
    path = Path(path)
    with writing(path) as part:
        part.write_text(spec.to_xml())
    return path
