"""What an antenna is to tell apart when it is designed: a task with touches to learn from and to ask."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.stimulus.trial import Trial
from feeler.task.task import Task


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class DesignTask(Task):
    """A :class:`feeler.task.Task`, and how many touches of each class are learned from and asked.

    Raises
    ------
    InvalidInput
        Fewer than two classes, or a field outside its range.
    """

    train: int = 4
    """Touches of each class that the decoder learns from."""
    test: int = 4
    """Other touches of each class that it is asked about."""
    timestep: float = 0.05
    """Integration step [ms]."""
    seeds: Any = (("optimiser", 1), ("test", 2), ("final", 3))
    """Of the touches for the optimiser, for tests, and for the final judgement that is looked at
    once.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.timestep < np.inf:
            raise InvalidInput(f"timestep must be finite and > 0 ms, got {self.timestep}.")
        if self.train < 2 or self.test < 1:
            raise InvalidInput(
                f"train must be ≥ 2 and test ≥ 1 touches of each class, got {self.train} and"
                f" {self.test}."
            )
        if not self.noise.size > 0:
            raise InvalidInput("the noise of a design's task must be > 0: without it all is told.")
        if self.n_classes < 2:
            raise InvalidInput(
                "a design's task needs at least two classes (objects × locations): with one there"
                " is nothing to tell apart."
            )
        if missing := {"optimiser", "test", "final"} - dict(self.seeds).keys():
            raise InvalidInput(f"seeds must name optimiser, test and final; {min(missing)} lacks.")

    def draw_classes(self, antenna: Antenna, purpose: str, speed: float) -> list[Trial]:
        """The touches for one purpose, class by class, ``train`` before ``test`` ones."""
        return self.draw(antenna, purpose, speed=speed, each=self.train + self.test)[0]
