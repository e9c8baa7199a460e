"""Claims of the paper and our own, each with the rule by which it is judged; ``verdicts`` applies
the rules.
"""

from functools import cache
from typing import Annotated, Literal

from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.records import Choice, Record
from paper.declared import read_declared
from paper.scale import SCALES

_FILES = {"paper": "claims.toml", "ours": "own_claims.toml"}


class Claim(Record):
    """One claim: what is said and where, its value, and how ours is held against it.

    ``kind`` is ``value`` (within ``tolerance`` of ``target``, relative), ``within`` (the same, and
    never partly), ``order`` (``keys`` rise in the order given), ``dip`` (the middle of three
    ``keys`` is the least), ``above`` or ``below`` the ``target``, ``share`` (the key is the share
    of a declared family of set-ups in which the statement holds), or ``none`` (``why`` says why it
    is not comparable).

    Attributes
    ----------
    figure : str
        The figure that it speaks of, and beside which it stands; empty: it stands at the end of its
        section.
    keys : tuple[str, ...]
        Values it is judged by; where there are ``definitions``, each holds ``{definition}``.
    due : str
        Least scale that computes enough to judge it.
    whose : Literal[paper, ours]
        ``paper``, or ``ours``: counted by themselves.
    standing : Literal[evidence, by construction, circular]
        Whether agreement says anything: ``by construction`` (an input, or arithmetic on inputs) and
        ``circular`` (its target was derived from the same constants) do not, and ``why`` says what
        it stems from.
    effect : str
        What its statement says there is, where several claims read it (``[[effect]]`` holds its
        words): they count once, together. Empty: the claim is a statement by itself.
    drawn : str
        What its values are ``n`` of: starts of a fit, repeats, sets of touches …; a value of one
        draw, or one that says no ``n``, is not judged. ``nothing``: they follow from what is
        declared, and no chance enters.
    definitions : tuple[str, ...]
        Readings that the paper leaves open. Only where all of them give one verdict is it the
        verdict. Each stands for ``{definition}`` in ``keys``, ``null`` and ``shows``.
    null : tuple[str, ...]
        For each key what the same pipeline reaches on identical touches, or on what ``null_says``.
    twin : tuple[str, str]
        What of the first and of the last key carries over to a twin of every touch; asked where
        identical touches do as well, of the first definition alone. Empty: nothing was asked.
    apart : Literal[greater, less]
        Which values discriminate touches more: ``greater`` or ``less``; for claims with a ``null``.
    shows : tuple[str, ...]
        Further values that stand beside it, and are not judged.
    unmet : str
        What stands against it where the run does not bear it out, and the variant that would; shown
        only there.
    """

    id: str
    where: str
    says: str
    paper: str = "–"
    tag: str
    kind: Literal["value", "within", "order", "dip", "above", "below", "share", "none"]
    section: str
    figure: str = ""
    keys: tuple[str, ...] = ()
    target: float = 0.0
    tolerance: float = 0.0
    due: Annotated[str, Choice(SCALES)] = "smoke"
    whose: Literal["paper", "ours"] = "paper"
    standing: Literal["evidence", "by construction", "circular"] = "evidence"
    effect: str = ""
    drawn: str = ""
    definitions: tuple[str, ...] = ()
    null: tuple[str, ...] = ()
    null_says: str = "identical touches are discriminated as much in at least one group"
    twin: tuple[str, ...] = ()
    apart: Literal["greater", "less"] = "greater"
    shows: tuple[str, ...] = ()
    why: str = ""
    unmet: str = ""

    def _check(self) -> None:
        if self.can_fail and not self.drawn:
            raise InvalidInput(
                f"claim {self.id!r} does not say what its values are drawn from; set `drawn`, for"
                ' instance to "starts", or to "nothing" where they follow from what is declared.'
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
        if self.twin and (len(self.twin) != 2 or not self.null):
            raise InvalidInput(
                f"claim {self.id!r} needs two twins, of its first and its last key, and a null;"
                f" got {len(self.twin)} and {len(self.null)}."
            )
        if self.definitions and not all("{definition}" in key for key in self.keys):
            raise InvalidInput(
                f"claim {self.id!r} has definitions; each of its keys must hold {{definition}}."
            )

    @property
    def can_fail(self) -> bool:
        """Whether its verdict would be evidence."""
        return self.standing == "evidence" and self.kind != "none"

    @property
    def statement(self) -> str:
        """What it is counted as: its effect, or itself."""
        return self.effect or self.id

    def list_keys(self) -> set[str]:
        """Every value that a run must write for it."""
        readings = [self.read_by(name) for name in self.definitions] or [self]
        return {
            key for one in readings for key in (*one.keys, *one.null, *one.twin, *one.shows)
        }

    def read_by(self, definition: str) -> "Claim":
        """The claim under one definition alone."""
        named = {
            part: tuple(key.replace("{definition}", definition) for key in getattr(self, part))
            for part in ("keys", "null", "shows")
        }
        twin = self.twin if definition == self.definitions[0] else ()
        return self.replace(definitions=(), twin=twin, **named)


@cache
def load_claims() -> tuple[Claim, ...]:
    """Every claim of claims.toml (the paper's), then of own_claims.toml (ours)."""
    return tuple(
        make_record(Claim, entry | {"whose": whose}, f"{name}, claim {entry.get('id')}")
        for whose, name in _FILES.items()
        for entry in read_declared(name)["claim"]
    )


@cache
def load_effects() -> dict[str, str]:
    """What every effect that several claims read says, in words."""
    return {one["id"]: one["says"] for one in read_declared(_FILES["paper"])["effect"]}
