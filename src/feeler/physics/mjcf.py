"""A scene as MJCF: for MuJoCo's own viewer, or for control of the antenna."""

from pathlib import Path

import mujoco
import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.physics.engine import choose_timestep, get_engine
from feeler.physics.scene import Scene, make_scene
from feeler.physics.spec import make_spec
from feeler.stimulus.trial import Trial

_SERVO = 2 * np.pi * 0.05  # [C] rad/ms; the base follows its command like a servo of 50 Hz
_BASE = ("base_x", "base_y", "base_turn")


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
    spec = make_spec(scene, choose_timestep(timestep, "mujoco"), moving=control)
    spec.comment = (
        "feeler scene in g, mm, ms (so N, N·mm, MPa): one second of the viewer's clock is one"
        " millisecond."
    )
    spec.stat.extent, spec.stat.center = antenna.length, [0.0, antenna.length / 2, 0.0]
    if control:
        _add_control(spec, scene)
    spec.compile()
    key = spec.add_key(name="start")
    if antenna.spatial:
        start = get_engine("mujoco").make([scene], spec.option.timestep)
        key.qpos, key.qvel = start.data.qpos.copy(), start.data.qvel.copy()  # type: ignore[attr-defined]
    elif control:
        key.qpos = [0.0] * len(_BASE) + [*scene.initial_angle]
        key.ctrl = [0.0] * len(_BASE)
    else:
        key.qpos = [*scene.initial_angle, 0.0, 0.0, 0.0]
        key.qvel = [*scene.initial_velocity, *scene.objects[0].velocity, scene.objects[0].turn]
    spec.compile()
    path = Path(path)
    path.write_text(spec.to_xml())
    return path


def _add_control(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Servos at the base, sensors at the sensors, objects that are put where one wants them."""
    mass = float(spec.body("base").mass)
    for name in _BASE:
        servo = spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, gear=[1, 0, 0, 0, 0, 0]
        )
        stiff = mass * _SERVO**2
        servo.set_to_position(kp=stiff, kv=2 * mass * _SERVO)  # critically damped
    for hinge in map(int, scene.antenna.sensors):
        _add_sensors(spec, scene.antenna, hinge)
    for number in range(1, len(scene.objects) + 1):
        body = spec.body(f"object{number}")
        for joint in list(body.joints):
            spec.delete(joint)
        body.mocap = True


def _add_sensors(spec: mujoco.MjSpec, antenna: Antenna, hinge: int) -> None:
    """Angle and velocity of a hinge, and touch on the segment beyond it."""
    joint = {"objtype": mujoco.mjtObj.mjOBJ_JOINT, "objname": f"hinge{hinge}"}
    spec.add_sensor(name=f"angle{hinge}", type=mujoco.mjtSensor.mjSENS_JOINTPOS, **joint)
    spec.add_sensor(name=f"velocity{hinge}", type=mujoco.mjtSensor.mjSENS_JOINTVEL, **joint)
    length, radius = antenna.segment_length[hinge - 1], antenna.radius[hinge - 1]
    spec.body(f"segment{hinge}").add_site(
        name=f"skin{hinge}",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, 0, length, 0],
        size=[2 * radius, 0, 0],  # wider than the segment: contacts lie on its surface
        rgba=[0, 0, 0, 0],
    )
    spec.add_sensor(
        name=f"touch{hinge}",
        type=mujoco.mjtSensor.mjSENS_TOUCH,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        objname=f"skin{hinge}",
    )
