"""Errors of feeler: each says what is wrong, what was got, what would be right and what to do."""

import re
import sys
import warnings
from collections.abc import Callable
from importlib.util import find_spec


class FeelerError(Exception):
    """Base of every error that feeler raises on purpose; the command line turns it into one line
    and exit code 2.
    """


class InvalidInput(FeelerError, ValueError):
    """A value, file or combination that cannot be used as given.

    Attributes
    ----------
    tables : tuple[str | int, ...]
        The fields (and places in them, from 1) that lead to that record from the outermost one.
    """

    subject = ""
    """What the message is about, where it begins so: the class of a record."""
    tables: tuple[str | int, ...] = ()


class SimulationDiverged(FeelerError, RuntimeError):
    """A simulation left the finite numbers.

    ``label`` and ``time`` [ms] say which and when; ``angle`` [rad] and ``velocity`` [rad/ms] are
    the last finite state.
    """

    state_file = ""
    """Where :func:`feeler.touch` has kept that state."""

    def __init__(
        self, label: str, time: float, angle=None, velocity=None, advice="Use a smaller timestep"
    ) -> None:
        super().__init__(
            f"the simulation of '{label}' diverged at {time:g} ms. {advice}; the other trials are"
            " not affected."
        )
        self.label, self.time, self.angle, self.velocity = label, time, angle, velocity
        self.advice = advice

    def __reduce__(self):
        return type(self), (self.label, self.time, self.angle, self.velocity, self.advice)


class Inaccurate(UserWarning):
    """Some touches did not reach the accuracy that was asked for."""


class Doubtful(UserWarning):
    """Physics was taken to where its models no longer hold; the message says by how much."""


class StoreError(FeelerError, OSError):
    """A store that is locked, damaged, or made by another configuration."""


class MissingExtra(FeelerError, ImportError):
    """An optional dependency is not installed; the message holds the install command."""


def require_extra(module: str, extra: str, what: str) -> None:
    """Raise MissingExtra at once if a library is not installed: before anything is computed."""
    if find_spec(module) is None:
        raise MissingExtra(f"{what} needs {module}: pip install 'feeler[{extra}]'.")


_PLAIN = ("Inaccurate", "Doubtful", "ConvergenceWarning")  # the last is scikit-learn's


def say_warnings(
    said: set[str] | None = None, put: Callable[[str], str] = lambda words: words
) -> None:
    """From now on print each kind of warning that a result calls for once, as one sentence without
    file and line: those above, and fits that ended early.

    Two warnings are of one kind if they differ in their numbers alone. Those in ``said`` count as
    printed; what is printed is added to it. All other warnings stay as they are. ``put`` puts the
    words into the language of who asked.
    """
    show = warnings.showwarning
    known = set() if said is None else said

    def say(message, category, filename, lineno, file=None, line=None) -> None:
        if not {base.__name__ for base in category.__mro__} & {*_PLAIN}:
            show(message, category, filename, lineno, file, line)
            return
        kind = re.sub(r"[\d.]+", "", str(message))
        if kind not in known:
            print(f"feeler: warning: {put(str(message))}", file=file or sys.stderr)
        known.add(kind)

    warnings.showwarning = say
