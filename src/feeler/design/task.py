"""What a designed antenna is to tell apart: a task with touches to learn from and to ask about."""

from typing import Annotated, Any

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.record import Ge, Gt, Unit
from feeler.stimulus.trial import Trial
from feeler.task.nuisances import Nuisances
from feeler.task.task import Task


class DesignTask(Task):
    """A :class:`feeler.task.Task`, and how many touches of each class are learned from and asked.

    Attributes
    ----------
    train : int
        Touches of each class that the decoder learns from.
    test : int
        Other touches of each class that it is asked about.
    unseen : Nuisances | None
        How those differ, if not as the touches that are learned from do: for example of sizes and
        at places that those never had.
    timestep : float
        Integration step [ms].
    seeds : Any
        Of the touches for the optimiser, for tests, and for the final judgement that is looked at
        once.

    Raises
    ------
    InvalidInput
        Fewer than two classes, or a field outside its range.
    """

    train: Annotated[int, Ge(2)] = 4
    test: Annotated[int, Ge(1)] = 4
    unseen: Nuisances | None = None
    timestep: Annotated[float, Gt(0), Unit("ms")] = 0.05
    seeds: Any = (("optimiser", 1), ("test", 2), ("final", 3))

    def _check(self) -> None:
        super()._check()
        if not self.noise.size > 0:
            raise InvalidInput(
                "the noise of a design's task must be > 0: without it all is told."
            )
        if self.n_classes < 2:
            raise InvalidInput(
                "a design's task needs at least two classes (objects × locations): with one there"
                " is nothing to tell apart."
            )
        if missing := {"optimiser", "test", "final"} - dict(self.seeds).keys():
            raise InvalidInput(
                f"seeds must name optimiser, test and final; {min(missing)} lacks."
            )

    def at(self, speed: float | None) -> "DesignTask":
        """The task at one speed of a design's own, if it has one."""
        return self if speed is None else self.replace(speeds=(speed,))

    def draw_classes(self, antenna: Antenna, purpose: str, speed: float) -> list[Trial]:
        """The touches for one purpose, class by class, ``train`` before ``test`` ones."""
        each = self.train + self.test
        met, _ = self.draw(antenna, purpose, speed=speed, each=each)
        if self.unseen is None:
            return met
        new, _ = self.replace(nuisances=self.unseen, unseen=None).draw(
            antenna, purpose, speed=speed, each=each
        )
        return [met[k] if k % each < self.train else new[k] for k in range(len(met))]
