"""A race: a person and a policy move the same antenna at the same touch, and one observer says what
each of them can know.

The observer knows two dozen touches, the shown one among them: the paper's six objects at other
places and distances. It feels the shown one with the same noise under either motion; who is sure of
its shape first, and right, wins.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any

import numpy as np
from scipy.special import softmax

from feeler.active import Observer, TouchTask, decide, parse_policy
from feeler.errors import InvalidInput
from feeler.physics.lanes import Simulations
from feeler.stimulus.trial import Trial
from feeler.studio.hand import Command
from feeler.studio.touching import INTERVAL
from feeler.studio.wish import TouchWish

SHAPES = ("ball", "box", "triangle")
RIVAL = "slow-after-contact:1.2,0.12"  # [C]
KNOWN, NOISE = 24, 0.03  # [C] touches, and rad per sample and sensor
SURE, LIMIT = (
    0.9,
    150.0,
)  # [C] probability at which a verdict is given, and ms that the policy has for it


@dataclass(frozen=True, eq=False)
class RaceTask(TouchTask):
    """Which shape is it, where one of the touches is the shown one?"""

    _: KW_ONLY
    shown: Trial

    @property
    def place(self) -> int:
        """Number of the shown touch: the first of its shape gives way to it."""
        return [feature.kind for feature in self.features].index(self.shown.feature.kind)

    @property
    def n_outputs(self) -> int:  # type: ignore[override]
        """Ball, box and triangle."""
        return len(SHAPES)

    def get_trial(self, index: int) -> Trial:
        """The drawn place with the objects in turn, so that each is as likely, or the shown touch."""
        if index == self.place:
            return self.shown
        return replace(
            self.trials[index],
            feature=self.features[index % len(self.features)],
            side=self.shown.side,
        )

    def get_target(self, index: int) -> float:
        """Number of the shape."""
        return float(SHAPES.index(self.get_trial(index).feature.kind))


class Race:
    """The policy's run, which is known at once, and the person's, millisecond by millisecond.

    Raises
    ------
    InvalidInput
        Nothing to race about: a wall, or more than one object.
    """

    def __init__(self, wish: TouchWish) -> None:
        if wish.kind not in SHAPES or wish.objects:
            raise InvalidInput(
                "a race is about one ball, box or triangle; choose one, and take further objects"
                " away."
            )
        shown = wish.make_trial()
        self.task = task = RaceTask(
            wish.antenna.make(), noise=NOISE, duration=LIMIT, pool=KNOWN, approach=wish.approach, friction=wish.friction,
            shown=replace(shown, speed=1.0, lead=wish.speed * wish.lead),
        )  # fmt: skip
        observer = Observer(task)
        self.target, self._place, self._label = (
            int(observer.label[task.place]),
            task.place,
            np.eye(len(SHAPES))[observer.label],
        )
        self.rival = observer.run(parse_policy(RIVAL), 1, touches=[task.place])
        self._noise = observer.make_noise()
        self._lanes = Simulations(
            [start.scene for start in observer.starts], timestep=task.timestep
        )
        self._sensors = task.first_antenna.sensors - 1
        self._evidence = np.zeros(KNOWN)
        self.belief = [self._believe()]

    def apply(self, commands: Sequence[Command]) -> None:
        """The base moves as the person's does."""
        for _, what, vx, vy, turn in commands:
            for lane in range(KNOWN if what < 0 else 0):
                self._lanes.move_base(lane, (vx, vy), turn)

    def step(self) -> None:
        """Go on by a sample.

        Raises
        ------
        SimulationDiverged
            One of the known touches cannot be felt any more.
        """
        self._lanes.step(INTERVAL)
        for error in self._lanes.failed:
            if error is not None:
                raise error
        known = self._lanes.state.angle[:, self._sensors] / NOISE
        felt = known[self._place] + self._noise.standard_normal(known.shape[1])
        self._evidence += known @ felt - 0.5 * (known**2).sum(axis=1)
        self.belief.append(self._believe())

    def _believe(self) -> np.ndarray:
        return softmax(self._evidence) @ self._label

    @property
    def over(self) -> bool:
        """Whether the person's observer is sure."""
        return float(self.belief[-1].max()) >= SURE

    def describe(self) -> dict[str, Any]:
        """The policy's run, for a page to draw."""
        rival = self.rival
        return {
            "name": RIVAL.partition(":")[0].replace("-", " "),
            "time": rival.time.tolist(),
            # fmt: skip
            "belief": rival.belief[:, 0].tolist(),
            "shapes": SHAPES,
            "target": self.target,
            "sure": SURE,
        }

    def judge(self) -> dict[str, Any]:
        """Both verdicts, and who won: ``you``, ``policy``, ``both`` or ``nobody``."""
        both = {
            "you": self._judge(np.array(self.belief), INTERVAL),
            "policy": self._judge(self.rival.belief[:, 0], self.rival.time[1]),
        }
        right = {who: one["time"] for who, one in both.items() if one["right"]}
        first = [who for who, time in right.items() if time == min(right.values())]
        return {**both, "won": "both" if len(first) == 2 else first[0] if first else "nobody"}

    def _judge(self, belief: np.ndarray, interval: float) -> dict[str, Any]:
        """When [ms] an observer was sure, of what, and whether rightly; no shape where it never
        was.
        """
        (when,), (answer,) = decide(belief[None], SURE)
        sure = bool(belief[when].max() >= SURE)
        return {
            "time": float(when * interval),
            "shape": SHAPES[answer] if sure else "",
            "right": sure and bool(answer == self.target),
        }
