"""Follow a wall: the body runs beside it and is asked how far away it is."""

from dataclasses import field
from functools import cached_property
from typing import Annotated

import numpy as np

from feeler.active.task import ActiveTask, Start
from feeler.antenna.space import require_plane
from feeler.errors import InvalidInput
from feeler.records.record import Gt, Unit
from feeler.wall.course import Course
from feeler.wall.following import BODY_LOST, FOLLOWING, RUN_SUBSTEP, make_course_scene
from feeler.wall.posture import Posture
from feeler.wall.sweep import Approach, approach

_STARTS = (9.0, 10.5, 12.0, 13.5, 15.0)  # [C] mm from the wall


def _make_courses() -> tuple[Course, ...]:
    """A straight wall, and walls with one turn to either side [C]."""
    return (
        Course(lengths=(400.0,), turns=()),
        *(Course(lengths=(80.0, 320.0), turns=(turn,)) for turn in (-30.0, -15.0, 15.0, 30.0)),
    )


class FollowTask(ActiveTask):
    """Keep a distance from a wall on the right, and say what the distance is.

    A prediction is the distance [mm]; the loss is its squared error over the target's square, and
    the same is charged for the distance itself, so that a body which keeps the target and knows it
    loses nothing. A body that runs into the wall has come to its end.

    Attributes
    ----------
    distance : float
        To keep, from the antenna's base [mm], [C].
    courses : tuple[Course, ...]
        Walls of which an episode draws one.
    starts : tuple[float, ...]
        Distances at which an episode may begin [mm].
    """

    distance: Annotated[float, Gt(0), Unit("mm")] = 12.0
    courses: tuple[Course, ...] = field(default_factory=_make_courses)
    starts: tuple[float, ...] = _STARTS
    posture: Posture = FOLLOWING

    def _check(self) -> None:
        super()._check()
        require_plane(self.first_antenna, "following a wall")
        if not self.courses or not self.starts:
            raise InvalidInput(
                "there is no wall to follow: give at least one of courses= and one of starts=."
            )

    @cached_property
    def rests(self) -> Approach:
        """The antenna at rest beside the wall, at each distance at which an episode may begin, the
        farthest first.
        """
        return approach(
            self.first_antenna,
            self.posture.replace(side="right"),
            sorted(self.starts),
            substep=RUN_SUBSTEP,
        )

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw a wall and a distance."""
        course = self.courses[int(rng.integers(len(self.courses)))]
        return self.make_start(course, int(rng.integers(len(self.rests.distance))))

    def make_start(self, course: Course, row: int) -> Start:
        """The beginning beside a wall, at distance number ``row``, the farthest first."""
        scene = make_course_scene(self.rests, row, course)
        distance = self.rests.distance[row]
        return Start(scene=scene, direction=(0.0, 1.0), target=distance, course=course)

    def measure(self, start: Start, base: np.ndarray) -> float:
        """Distance of the base from the wall [mm]."""
        assert start.course is not None
        return float(start.course.measure(base[None, :2])[0])

    def is_over(self, target: float) -> bool:
        """Whether the body has run into the wall."""
        return target <= BODY_LOST

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Squared error (lane,) over the square of the distance to keep."""
        return (prediction[:, 0] - target) ** 2 / self.distance**2

    def charge(self, target: np.ndarray) -> np.ndarray:
        """What being elsewhere than asked costs (lane,)."""
        return (target - self.distance) ** 2 / self.distance**2
