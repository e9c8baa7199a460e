"""Claims of the paper and our own, each with the rule by which it is judged; ``verdicts`` applies
the rules.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from feeler.errors import InvalidInput
from feeler.studies.scale import SCALES

PROFILES = ("exponential", "linear", "constant")  # [P] in the order claimed
READ_BETTER = {
    "speed": "slower touch is classified better",
    "profile": "exponential is classified best, constant worst",
}
SPREADS_MORE = {
    "speed": "slower touch spreads tensors more",
    "profile": "exponential spreads tensors most, constant least",
}
KINDS = ("value", "order", "dip", "above", "below", "share", "none")
STANDINGS = ("evidence", "by construction", "circular")
WHOSE = ("paper", "ours")
FILES = {"paper": "claims.toml", "ours": "own_claims.toml"}


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim: what is said and where, its value, and how ours is held against it.

    ``kind`` is ``value`` (within ``tolerance`` of ``target``, relative), ``order`` (``keys`` rise
    in the order given), ``dip`` (the middle of three ``keys`` is the least), ``above`` or ``below``
    the ``target``, ``share`` (the key is the share of a declared family of set-ups in which the
    statement holds), or ``none`` (``why`` says why it is not comparable).
    """

    id: str
    where: str
    says: str
    paper: str = "–"
    tag: str
    kind: str
    section: str
    figure: str = ""
    """The figure that it speaks of, and beside which it stands; empty: it stands at the end of its
    section.
    """
    keys: tuple[str, ...] = ()
    """Values it is judged by; where there are ``definitions``, each holds ``{definition}``."""
    target: float = 0.0
    tolerance: float = 0.0
    due: str = "smoke"
    """Least scale that computes enough to judge it."""
    whose: str = "paper"
    """``paper``, or ``ours``: counted by themselves."""
    standing: str = "evidence"
    """Whether agreement says anything: ``by construction`` (an input, or arithmetic on inputs) and
    ``circular`` (its target was derived from the same constants) do not, and ``why`` says what it
    stems from."""
    definitions: tuple[str, ...] = ()
    """Readings that the paper leaves open. Only where all of them give one verdict is it the
    verdict.
    """
    null: tuple[str, ...] = ()
    """For each key what the same pipeline reaches on identical touches."""
    apart: str = "greater"
    """Which values tell touches apart more: ``greater`` or ``less``; for claims with a ``null``."""
    shows: tuple[str, ...] = ()
    """Further values that stand beside it, and are not judged."""
    why: str = ""
    unmet: str = ""
    """What stands against it where the run does not bear it out, and the variant that would; shown
    only there.
    """

    def __post_init__(self) -> None:
        SCALES[self.due]  # refuses what is no scale
        choices = (
            ("kind", KINDS),
            ("standing", STANDINGS),
            ("whose", WHOSE),
            ("apart", ("greater", "less")),
        )
        for name, valid in choices:
            if (value := getattr(self, name)) not in valid:
                raise InvalidInput(
                    f"claim {self.id!r} has the unknown {name} {value!r}; valid:"
                    f" {', '.join(valid)}."
                )
        if (self.standing != "evidence" or self.kind == "none") and not self.why:
            raise InvalidInput(
                f"claim {self.id!r} carries no evidence and says not why; add a sentence as `why`."
            )
        if self.null and len(self.null) != len(self.keys):
            raise InvalidInput(
                f"claim {self.id!r} has {len(self.keys)} keys but {len(self.null)} nulls; give one"
                " each."
            )
        if self.definitions and not all("{definition}" in key for key in self.keys):
            raise InvalidInput(
                f"claim {self.id!r} has definitions; each of its keys must hold {{definition}}."
            )

    def list_keys(self) -> set[str]:
        """Every value that a run must write for it."""
        return {key for reading in self.definitions or ("",) for key in self.read_by(reading)} | {
            *self.null,
            *self.shows,
        }

    def read_by(self, definition: str) -> tuple[str, ...]:
        """The keys under one definition."""
        return tuple(key.replace("{definition}", definition) for key in self.keys)


@cache
def load_claims() -> tuple[Claim, ...]:
    """Every claim of claims.toml (the paper's), then of own_claims.toml (ours)."""
    return tuple(_make(entry, whose) for whose, name in FILES.items() for entry in _read(name))


def _read(name: str) -> list[dict]:
    return tomllib.loads(files("feeler.studies.paper").joinpath(name).read_text(encoding="utf-8"))[
        "claim"
    ]


def _make(entry: dict, whose: str) -> Claim:
    lists = {key: tuple(value) for key, value in entry.items() if isinstance(value, list)}
    return Claim(**entry | lists, whose=whose)
