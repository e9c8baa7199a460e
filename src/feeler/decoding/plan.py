"""How much to compute of accuracy against noise."""

from typing import Annotated, Literal

from feeler.records.record import Ge, Gt, Len, Record

_Count = Annotated[int, Ge(1)]


class Plan(Record):
    """Ratios, repeats and copies of every noise sweep of a study.

    Attributes
    ----------
    ratios : tuple[float, ...]
        Noise ratios of the main curves.
    n_repeats : int
        Repeats of the main curves; the paper's is ten [P].
    control_repeats : int | None
        Repeats of the curves beside them: other noises and codes than the paper's, and nulls. None:
        as many.
    n_copies : int
        Noisy copies per trial [C].
    other_copies : tuple[int, ...]
        Other numbers of copies, at ``probe``.
    probe : float
        Noise ratio of everything that is computed at one ratio only.
    before_copies : int
        Copies per trial where noise is added before encoding: each has to be encoded.
    before_repeats : int
        0 leaves noise before encoding out.
    before_all : bool
        Noise before encoding for all groups and noises, or for one of each.
    n_restarts : int
        Restarts of an encoder's fit.
    null_iter : int
        Iterations of the joint fits of identical touches and of twins.
    twins : str
        Groups whose touches are fitted twice: all, the ends of each comparison, or none.
    """

    ratios: Annotated[tuple[Annotated[float, Ge(0)], ...], Len(1)]
    n_repeats: _Count
    control_repeats: _Count | None = None
    n_copies: _Count = 10
    other_copies: tuple[_Count, ...] = (3, 30)
    probe: Annotated[float, Gt(0)] = 0.2
    other_repeats: _Count = 1
    before_copies: _Count = 10
    before_repeats: Annotated[int, Ge(0)] = 1
    before_all: bool = False
    n_restarts: _Count = 3
    null_iter: _Count = 100
    twins: Literal["all", "ends", "none"] = "all"
