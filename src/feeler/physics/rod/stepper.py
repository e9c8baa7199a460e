"""The rod, stepped: one scene."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from feeler.antenna.space import require_plane
from feeler.errors import InvalidInput
from feeler.physics.engine import announce_compiling
from feeler.physics.rod import fields as f
from feeler.physics.rod.march import march, relax
from feeler.physics.rod.model import FIRMNESS, SOFT, RodLane, make_rod_lane, make_rod_model
from feeler.physics.rod.newton import place_nodes
from feeler.physics.scene import Scene
from feeler.physics.stepper import Contacts, State, Stepper

_MAX_STEPS = 400  # of one relaxation
_BALANCED = 1e-6  # rad; greatest out-of-balance torque over hinge stiffness at rest


class Rest(NamedTuple):
    """How a relaxation ended.

    Attributes
    ----------
    imbalance : float
        Greatest out-of-balance torque over the hinge's stiffness [rad]; infinite where it got
        stuck.
    n_contacts : int
        Touching nodes.
    """

    imbalance: float
    n_contacts: int

    @property
    def balanced(self) -> bool:
        """Whether it is an equilibrium."""
        return self.imbalance < 10 * _BALANCED


class RodStepper(Stepper):
    """One scene as a rod of implicit steps, without inertia (it follows its own damping) or with
    mass at its nodes.
    """

    advice = "Use a smaller timestep, a slower feature, or a hinge damping that is not zero"

    def __init__(
        self, scenes: Sequence[Scene], timestep: float, *, inertia: bool = False
    ) -> None:
        self.timestep, self.inertia, self.scenes = float(timestep), inertia, list(scenes)
        if len(self.scenes) != 1:
            raise InvalidInput(
                f"the rod engine steps one scene at a time, got {len(self.scenes)}."
            )
        self.reset(0, self.scenes[0])
        with announce_compiling("rod"):
            march(self.model, self.lane, 0, self.timestep, self.drive, self.inertia)

    def reset(self, lane: int, scene: Scene) -> None:
        """Begin another scene."""
        require_plane(scene.antenna, "the rod engine")
        if scene.initial_velocity.any() and not self.inertia:
            raise InvalidInput(
                "engine 'rod' has no inertia, so that velocity= means nothing to it; leave it out,"
                " or use engine='rod-inertia'."
            )
        self.model = make_rod_model(scene, SOFT if self.inertia else FIRMNESS)
        self.lane, self.scenes[0], self.lost = make_rod_lane(scene, self.model), scene, False
        self.drive = np.array([scene.base_velocity])
        place_nodes(self.model.table, self.lane.base, self.lane.heading, self.lane.points)

    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps; ``drives`` (step, 3) replace the commanded base velocity. A lost antenna
        stays where it was.
        """
        drive = np.ascontiguousarray(drives[0], dtype=float) if drives else self.drive
        if n_steps and not self.lost:
            self.lost = not march(
                self.model, self.lane, n_steps, self.timestep, drive, self.inertia
            )
            self.drive = drive[-1:].copy()
        return self.lost

    def settle(
        self,
        base: Sequence[float] | None = None,
        place: Sequence[Sequence[float]] | None = None,
    ) -> Rest:
        """Relax to the equilibrium nearest along the antenna's own damping, and stand still there.

        Parameters
        ----------
        base
            Place [mm] and heading [rad] (3,) to which the base is put first; the antenna turns
            along. Default: as it is.
        place
            Places (object, 2) [mm] to which the objects are put first. Default: as they are.
        """
        before = float(self.lane.base[2])
        if base is not None:
            self.lane.base[:] = base
        if place is not None:
            self.lane.objects[:, [f.O_X, f.O_Y]] = place
        self.lane.velocity[:] = 0.0
        rest = Rest(*relax(self.model, self.lane, before, _BALANCED, _MAX_STEPS))
        self.lane.rate[:], self.lost = 0.0, False
        return rest

    def read(self) -> State:
        """The state, as copies."""
        t, contacts = self.lane, self.read_contacts(0)
        force = np.zeros((len(t.objects), 2))
        np.add.at(force, contacts.object, contacts.force)
        normal = np.sum(contacts.force * contacts.normal, axis=1)
        return State(
            angle=np.diff(t.heading, prepend=t.base[2])[None],
            velocity=t.rate[None].copy(),
            force=force[None],
            place=t.objects[None, :, [f.O_X, f.O_Y]],
            forward=t.objects[None, :, [f.O_FORWARD_X, f.O_FORWARD_Y]],
            object_work=t.work[None, 1:].copy(),
            base=t.base[None].copy(),
            base_force=t.wrench[None, :2].copy(),
            base_moment=t.wrench[2:].copy(),
            base_work=t.work[:1].copy(),
            contact_place=np.array(
                [normal @ contacts.place / normal.sum() if len(contacts) else np.nan]
            ),
            sink=t.sink.copy(),
        )

    def read_sink(self) -> np.ndarray:
        """How deep nodes have sunk in at most (1,)."""
        return self.lane.sink

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of the last step: nodes that touch."""
        node, part = np.nonzero(self.lane.push[:, :, f.C_DEPTH] > 0)
        found, antenna = self.lane.push[node, part], self.scenes[0].antenna
        normal = found[:, [f.C_NX, f.C_NY]]
        near = self.model.table[node, f.R_RADIUS] - found[:, f.C_DEPTH] / 2
        return Contacts(
            object=self.model.parts[part, f.P_OBJECT].astype(int),
            segment=node + 1,
            place=np.cumsum(antenna.segment_length)[node] / antenna.length,
            point=self.lane.points[node + 1] - near[:, None] * normal,
            normal=normal,
            distance=-found[:, f.C_DEPTH],
            force=found[:, [f.C_FX, f.C_FY]],
        )

    def find_broken(self) -> np.ndarray:
        """Whether a step had no end, however finely it was divided."""
        return np.array([self.lost or not np.isfinite(self.lane.heading).all()])

    def explain(self, lane: int) -> None:
        """Nothing beyond that."""

    def move_base(self, lane: int, velocity: tuple[float, float], turn: float) -> None:
        """Command the base."""
        self.drive = np.array([[*velocity, turn]])

    def move_object(
        self, lane: int, o: int, velocity: tuple[float, float], turn: float
    ) -> None:
        """Command an object."""
        self.lane.objects[o, f.O_VX : f.O_TURN + 1] = *velocity, turn

    def save(self, lane: int) -> tuple[RodLane, np.ndarray, bool]:
        """All that the future depends on, but for the scene."""
        return RodLane(*(array.copy() for array in self.lane)), self.drive.copy(), self.lost

    def load(self, lane: int, saved: tuple[RodLane, np.ndarray, bool]) -> None:
        """Go back to where it was saved."""
        self.lane, self.drive, self.lost = (
            RodLane(*(array.copy() for array in saved[0])),
            saved[1].copy(),
            saved[2],
        )
