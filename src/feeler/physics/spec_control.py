"""What makes a model one to control: servos at its base, sensors, objects that are put."""

import mujoco
import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.physics.scene import Scene

SERVOS = ("base_x", "base_y", "base_turn")
_STIFF = 2 * np.pi * 0.05  # [C] rad/ms; the base follows its command like a servo of 50 Hz


def add_control(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Servos at the base, sensors at the sensors, objects that are put where one wants them."""
    mass = float(spec.body("base").mass)
    for name in SERVOS:
        servo = spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, gear=[1, 0, 0, 0, 0, 0]
        )
        stiff = mass * _STIFF**2
        servo.set_to_position(kp=stiff, kv=2 * mass * _STIFF)  # critically damped
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
