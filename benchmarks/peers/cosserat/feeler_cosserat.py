"""feeler's chain engine as a solver of cosseratbench: a planar, inextensible chain of rigid
elements.

It takes part with one rod whose start is clamped or pinned and whose other end is free, bent in one
plane by gravity and a constant force at its end. What a planar hinge chain cannot do, and says so:
stretch, shear, twist, bending out of a plane, a second held end, driven ends, other rods, and
contact with obstacles other than feeler's own features.
"""

import numpy as np
from cosseratbench.scenario import End, EndCondition, Rod, Scenario, parallel_transport
from cosseratbench.solver import Diverged
from cosseratbench.trajectory import Trajectory

import feeler
from feeler.antenna.segments import Antenna
from feeler.physics.chain.fields import B_PULL_X, B_PULL_Y
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.contact import Contact
from feeler.physics.scene import Clock, Scene

STEP = 0.02  # time step over the period of the stiffest bending wave, divided by 2π
M, KG, S = 1e3, 1e3, 1e3  # mm, g, ms


class ChainSolver:
    """The chain engine behind cosseratbench's solver interface."""

    name = "feeler"
    capabilities = frozenset()
    backend_version = getattr(feeler, "__version__", "0.1.0")

    def __init__(self, time_step_scale: float = 1.0) -> None:
        self.time_step_scale = time_step_scale

    def settings(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> dict:
        """Numerical choices of a run."""
        rod = scenario.rods[0]
        clock = self._make_clock(scenario, rod, n_elements, n_frames)
        return {"time_step": clock.timestep / S, "joint_damping": _choose_damping(scenario)}

    def run(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> Trajectory:
        """Simulate the scenario's one rod."""
        rod = _check(scenario)
        nodes = rod.nodes(n_elements)
        axes = _find_plane(scenario, rod, nodes)
        scene = _make_scene(scenario, rod, nodes, axes)
        clock = self._make_clock(scenario, rod, n_elements, n_frames)
        stepper = ChainStepper([scene], clock.timestep)
        pull = axes @ sum((np.asarray(p.force) for p in rod.loads), np.zeros(3))
        stepper.tables.base[0, [B_PULL_X, B_PULL_Y], 0] = pull
        angle = np.empty((clock.n_samples, n_elements))
        for k, time in enumerate(clock.time):
            stepper.step(clock.steps_per_sample if k else 0)
            angle[k] = stepper.read().angle[0]
            if not np.isfinite(angle[k]).all():
                raise Diverged("angles left the finite numbers", time / S)
        return _make_trajectory(scene, clock.time, angle, rod, nodes[0], axes)

    def _make_clock(
        self, scenario: Scenario, rod: Rod, n_elements: int, n_frames: int
    ) -> Clock:
        material, length = rod.material, rod.length / n_elements
        wave = np.sqrt(
            material.youngs_modulus * rod.second_moment_of_area / (material.density * rod.area)
        )
        stiffest = 4 * wave / length**2
        interval = scenario.duration * S / (n_frames - 1)
        wanted = STEP * self.time_step_scale / stiffest * S
        steps = int(np.ceil(interval / wanted))
        return Clock(
            duration=interval * (n_frames - 0.5),
            sample_interval=interval,
            timestep=interval / steps,
        )


def _check(scenario: Scenario) -> Rod:
    if len(scenario.rods) != 1 or scenario.obstacles:
        raise NotImplementedError("one rod alone, without obstacles")
    rod = scenario.rods[0]
    if rod.start is EndCondition.FREE or rod.end is not EndCondition.FREE:
        raise NotImplementedError(
            "the end that is not held to be free: a chain hangs on its start"
        )
    if rod.start_motion is not None or any(load.at is End.START for load in rod.loads):
        raise NotImplementedError("the start to be held still")
    return rod


def _find_plane(scenario: Scenario, rod: Rod, nodes: np.ndarray) -> np.ndarray:
    """Rows: the world directions of feeler's x (across) and y (along the first element)."""
    along = (nodes[1] - nodes[0]) / np.linalg.norm(nodes[1] - nodes[0])
    vectors = [scenario.gravity, *(load.force for load in rod.loads), *(nodes - nodes[0])]
    across = np.array(vectors, dtype=float)
    sizes = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.where(sizes > 0, sizes, 1.0)
    across -= np.outer(across @ along, along)
    best = across[np.linalg.norm(across, axis=1).argmax()]
    if np.linalg.norm(best) < 1e-9:
        best = np.cross(along, rod.normal)
    best = best / np.linalg.norm(best)
    if np.abs(across @ np.cross(along, best)).max() > 1e-9:
        raise NotImplementedError("bending in one plane")
    return np.stack([best, along])


def _choose_damping(scenario: Scenario) -> float:
    """Damping over stiffness [s]: critical for the slowest mode where only the equilibrium counts,
    else none.
    """
    return 2.0 / scenario.slowest_frequency() if scenario.quasi_static else 0.0


def _make_scene(scenario: Scenario, rod: Rod, nodes: np.ndarray, axes: np.ndarray) -> Scene:
    n, material = len(nodes) - 1, rod.material
    length = rod.length / n
    stiffness = np.full(n, material.youngs_modulus * rod.second_moment_of_area / length * M)
    stiffness[0] = (
        0.0 if rod.start is EndCondition.PINNED else 2 * stiffness[0]
    )  # half an element from the clamp
    steps = np.diff(nodes, axis=0) @ axes.T
    heading = np.unwrap(np.arctan2(steps[:, 0], steps[:, 1]))
    antenna = Antenna(
        segment_length=np.full(n, length * M),
        segment_mass=material.density * rod.area * length * KG,
        radius=rod.radius * M,
        stiffness=stiffness,
        damping=stiffness * _choose_damping(scenario) * S,
    )
    return Scene(
        antenna=antenna,
        contact=Contact(solref=(1e6, 1.0)),  # nothing to touch
        gravity=tuple(axes @ np.asarray(scenario.gravity) * M / S**2),
        base=(0.0, 0.0, float(heading[0])),
        angle=np.diff(heading, prepend=heading[0]),
        label="rod",
    )


def _make_trajectory(
    scene: Scene,
    time: np.ndarray,
    angle: np.ndarray,
    rod: Rod,
    start: np.ndarray,
    axes: np.ndarray,
) -> Trajectory:
    points = scene.antenna.shape(angle, scene.base[2]) / M @ axes + start
    directors = np.stack(
        [parallel_transport(frame, np.asarray(rod.normal, dtype=float)) for frame in points]
    )
    return Trajectory(time / S, (points,), (directors,))
