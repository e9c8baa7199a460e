"""Time per step of a free chain of n segments: chain engine, MuJoCo, Pinocchio's ABA, PyElastica.
One thread.

What is compared: one step of a chain of rigid links (chain engine and MuJoCo: kinematics, dynamics,
integration in compiled code; Pinocchio: `aba` alone, called from Python, without integration,
damping or contact) and one position–Verlet step of a Cosserat rod with as many elements
(PyElastica: stretch, shear, twist and bending in three dimensions). Peers take turns, and the
fastest turn in processor time counts.

    python benchmarks/peers/speed.py
"""

import json
import time
from pathlib import Path

import elastica as ea
import mujoco as mj
import numpy as np
import pinocchio as pin

from feeler.antenna.segments import Antenna
from feeler.physics import mujoco
from feeler.physics.chain.fields import LANES
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.scene import Scene

SEGMENTS = (10, 140, 300, 1000)
MOST = {
    "Pinocchio aba": 300
}  # segments; its Data holds arrays of n³ numbers: 4 GB for 400 segments
TURNS, TURN = 7, 0.05  # number; about as long [s of processor time]
LENGTH, MASS, RADIUS = 42.0, 2e-3, 0.1  # mm, g, mm: a uniform rod of the antenna's size
TIMESTEP = 0.02  # ms


def time_all(steps: dict) -> dict[str, float]:
    """Best processor time per step of each [µs], taking turns of about TURN."""
    best = {}
    for name, step in steps.items():
        step(1)  # compiles
        best[name] = time_once(step, 2)
    for _ in range(TURNS):
        for name, step in steps.items():
            best[name] = min(
                best[name], time_once(step, int(np.clip(TURN * 1e6 / best[name], 2, 1000)))
            )
    return best


def time_once(step, n_steps: int) -> float:
    """Processor time per step [µs]."""
    start = time.process_time()
    step(n_steps)
    return (time.process_time() - start) / n_steps * 1e6


def make_scene(n: int) -> Scene:
    """A rod of n rigid segments, slightly bent."""
    antenna = Antenna(
        segment_length=np.full(n, LENGTH / n),
        segment_mass=MASS / n,
        radius=RADIUS,
        stiffness=1.0,
        damping=1.0,
    )
    return Scene(antenna=antenna, angle=np.random.default_rng(0).normal(0, 1e-3, n))


def make_mujoco(n: int):
    """Steps of the same chain in MuJoCo, dense Jacobian, nothing collides."""
    scene = make_scene(n)
    model = mujoco.compile_model(scene, TIMESTEP)
    data = mj.MjData(model)
    data.qpos[:] = scene.initial_angle
    return lambda n_steps: mj.mj_step(model, data, nstep=n_steps)


def make_chain(n: int, lanes: int):
    """Steps of ``lanes`` chains."""
    return ChainStepper([make_scene(n)] * lanes, TIMESTEP).step


def make_pinocchio(n: int):
    """Forward dynamics of the same chain of revolute joints."""
    model, parent = pin.Model(), 0
    length, mass = LENGTH / n, MASS / n
    for i in range(n):
        place = pin.SE3(np.eye(3), np.array([0.0, length if i else 0.0, 0.0]))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"hinge{i}")
        rod = np.diag([mass * length**2 / 12, 1e-12, mass * length**2 / 12])
        model.appendBodyToJoint(
            parent, pin.Inertia(mass, np.array([0, length / 2, 0]), rod), pin.SE3.Identity()
        )
    model.gravity = pin.Motion.Zero()
    data, rng = model.createData(), np.random.default_rng(0)
    q, v, torque = rng.normal(0, 1e-3, n), np.zeros(n), rng.normal(0, 1e-3, n)

    def step(n_steps: int) -> None:
        for _ in range(n_steps):
            pin.aba(model, data, q, v, torque)

    return step


def make_elastica(n: int):
    """Position–Verlet steps of a rod clamped at its base, in g, mm, ms."""

    class Simulator(ea.BaseSystemCollection, ea.Constraints):
        pass

    simulator = Simulator()
    rod = ea.CosseratRod.straight_rod(
        n, np.zeros(3), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), LENGTH, RADIUS,
        MASS / (np.pi * RADIUS**2 * LENGTH), youngs_modulus=1e3, shear_modulus=4e2,
    )  # fmt: skip
    simulator.append(rod)
    simulator.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    simulator.finalize()
    stepper = ea.PositionVerlet()
    dt = 1e-6

    def step(n_steps: int) -> None:
        now = 0.0
        for _ in range(n_steps):
            now = stepper.step(simulator, np.float64(now), np.float64(dt))

    return step


def main() -> None:
    results = {}
    for n in SEGMENTS:
        makers = {
            "chain": lambda n: make_chain(n, 1),
            f"chain, {LANES} lanes": lambda n: make_chain(n, LANES),
            "MuJoCo mj_step": make_mujoco,
            "Pinocchio aba": make_pinocchio,
            "PyElastica step": make_elastica,
        }
        found = time_all(
            {name: make(n) for name, make in makers.items() if n <= MOST.get(name, n)}
        )
        found[f"chain, {LANES} lanes"] /= LANES
        results[str(n)] = found
        print(n, {name: round(value, 2) for name, value in found.items()}, flush=True)
    path = Path(__file__).parents[1] / "results" / "peers.json"
    rounded = json.loads(json.dumps(results), parse_float=lambda x: float(f"{float(x):.3g}"))
    path.write_text(json.dumps(rounded, indent=1) + "\n")


if __name__ == "__main__":
    main()
