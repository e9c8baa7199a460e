"""What a run of the paper is made with: scale, seed, antenna, engine, and where things go."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from feeler.antenna.segments import Antenna, require_plane
from feeler.draw import check_seed
from feeler.objects.trials import FRICTION
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.scene import Clock
from feeler.presets import cockroach
from feeler.provenance import to_jsonable
from paper.scale import SCALES, Scale

KEYED = ("scale", "seed", "engine", "timestep", "antenna")
"""What can change a number; a stage says which of them it reads."""
OWN = "this antenna"
"""What another antenna than the paper's is called in a run, whatever its own name."""
_THROUGH = {
    "effort": ("scale",),
    "profiles": ("antenna",),
    "is_cockroach": ("antenna",),
    "physics": ("engine", "timestep"),
}
"""Which of ``KEYED`` each property is read through."""


@dataclass(frozen=True, kw_only=True)
class Context:
    """The one dial and everything it does not turn.

    Attributes
    ----------
    timestep : float
        [ms]; default: the engine's own.
    inputs : Path | None
        File of what the paper does not publish; see inputs.toml.
    started : float
        When the run began [s since 1970]: a ``fresh`` run uses only what was made since.
    progress : Callable[[int, int], None] | None
        Called with (trials done, trials in all) while tensors are made.
    """

    scale: str = "published"
    seed: int = 0
    engine: str = DEFAULT_ENGINE
    timestep: float = None  # type: ignore[assignment]
    workers: int | None = None
    antenna: Antenna = field(default_factory=cockroach)
    is_cockroach: bool = True
    out: Path = Path("out")
    fresh: bool = False
    inputs: Path | None = None
    started: float = field(default_factory=time.time, compare=False)
    progress: Callable[[int, int], None] | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        SCALES[self.scale]  # refuses what is no scale
        check_seed(self.seed)  # refuses what is no seed
        require_plane(self.antenna, "the paper's run")
        contact = get_contact(None, self.antenna)
        object.__setattr__(
            self, "timestep", choose_timestep(self.timestep, self.engine, contact)
        )
        Clock(duration=1.0, timestep=self.timestep)
        contact.check_timestep(self.timestep)

    @property
    def effort(self) -> Scale:
        """How much is computed at this scale."""
        return SCALES[self.scale]

    @property
    def vector(self) -> bool:
        """Whether figures are also drawn as PDF."""
        return self.effort.vector

    @property
    def physics(self) -> dict[str, Any]:
        """``engine``, ``timestep`` [ms] and ``workers``, as :func:`feeler.touch` takes them."""
        return {"engine": self.engine, "timestep": self.timestep, "workers": self.workers}

    @cached_property
    def profiles(self) -> dict[str, Antenna]:
        """The antenna and its controls: for the cockroach the paper's two and the
        matched-compliance one.
        """
        if not self.is_cockroach:
            return {OWN: self.antenna}
        return {
            "exponential": self.antenna,
            **{name: cockroach(name) for name in ("linear", "uniform", "matched")},
        }

    def describe(self, reads: Sequence[str] = KEYED) -> dict[str, object]:
        """Everything that can change a number, as plain data; not the number of workers, which
        cannot. Who simulates reads the engine, and then the defaults of contact count, too.
        """
        described = {
            name: self.profiles if name == "antenna" else getattr(self, name) for name in reads
        }
        if "engine" in reads:
            described["contact"] = {"friction": FRICTION, "softness": get_contact()}
        return to_jsonable(described)


@dataclass(frozen=True)
class View:
    """A context of which only some of ``KEYED`` can be read, so that no stage depends on what its
    key does not hold.
    """

    context: Context
    reads: tuple[str, ...]

    def __getattr__(self, name: str) -> object:
        for source in _THROUGH.get(name, (name,)):
            if source in KEYED and source not in self.reads:
                raise AttributeError(
                    f"this stage reads context.{name} but does not declare {source!r}:"
                    f" {self.reads}."
                )
        return getattr(self.context, name)
