"""Wrong arguments of public functions give errors of feeler, whichever of them is wrong."""

import inspect
import signal
from functools import cache

import numpy as np
import pytest

import feeler
from feeler.errors import FeelerError, InvalidInput

WRONG = (None, "x", object(), float("nan"), -1, [[1], [1, 2]], np.zeros((2, 3, 4)))
PATIENCE = 2  # s; what still computes then has accepted its arguments
NOT_OURS = {"reproduce"}  # runs the paper
ABSTRACT = {"Feature"}


@cache
def list_public():
    """Every public callable by package and name; asked by tests, so that collection of tests does
    not import all there is.
    """
    rooms = [name for name in dir(feeler) if inspect.ismodule(getattr(feeler, name))]
    found = {}
    for room, module in [
        ("feeler", feeler),
        *((room, getattr(feeler, room)) for room in rooms),
    ]:
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            if callable(thing) and name not in NOT_OURS:
                found.setdefault(id(thing), (f"{room}.{name}", thing))
    return dict(found.values())


def list_checked():
    return {
        name: thing for name, thing in list_public().items() if hasattr(thing, "find_rules")
    }


def _list_classes():
    return {
        name: thing
        for name, thing in list_public().items()
        if inspect.isclass(thing)
        and name.split(".")[0] in ("feeler", "objects", "antenna")
        and name.split(".")[1] not in ABSTRACT
    }


def make_right(annotation, default):
    """A value of the annotated type."""
    if default is not inspect.Parameter.empty:
        return default
    words = str(annotation)
    plain = {float: 0.5, int: 2, str: "a", bool: True, np.ndarray: np.zeros((2, 3))}
    if annotation in plain:
        return plain[annotation]
    if annotation is feeler.Antenna:
        return feeler.presets.cockroach()
    if "Feature" in words:
        return feeler.Ball(radius=1.0)
    return (
        "a"
        if "Path" in words
        else ([] if "Sequence" in words or "list" in words or "tuple" in words else None)
    )


def make_arguments(thing):
    given = inspect.signature(thing).parameters.values()
    named = [p for p in given if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    return {p.name: make_right(p.annotation, p.default) for p in named}


def list_wrong(thing):
    """Arguments of which one does not fit, with its name."""
    right, rules = make_arguments(thing), thing.find_rules()

    def fits(key, value):
        try:
            rules.read({key: value})
        except InvalidInput:
            return False
        return True

    wrong = {key for key in rules.hints if key in right and not fits(key, right[key])}
    for key in rules.hints:
        if not wrong - {key}:
            yield from ((key, right | {key: value}) for value in WRONG if not fits(key, value))


@pytest.mark.long
def test_what_does_not_fit_is_named_before_anything_runs():
    unsaid = []
    for name, thing in list_checked().items():
        for key, arguments in list_wrong(thing):
            try:
                thing(**arguments)
                unsaid.append((name, key, "accepted"))
            except Exception as error:
                if not isinstance(error, InvalidInput) or f": {key} must be" not in str(error):
                    unsaid.append((name, key, repr(error)))
    assert unsaid == []


def test_what_makes_no_object_is_refused():
    foreign = []
    for name, kind in _list_classes().items():
        right = make_arguments(kind)
        for key in right:
            for value in WRONG:
                try:
                    kind(**right | {key: value})  # what is accepted is accepted
                except FeelerError:
                    pass
                except Exception as error:
                    foreign.append((name, key, repr(error)))
    assert foreign == []


@pytest.mark.long
def test_nothing_wrong_gives_a_foreign_error(tmp_path, monkeypatch):
    def stop(*_):
        raise FeelerError("accepted")

    monkeypatch.chdir(tmp_path)
    signal.signal(signal.SIGALRM, stop)
    foreign = []
    for name, thing in list_public().items():
        if inspect.isclass(thing) and (
            issubclass(thing, Exception) or inspect.isabstract(thing)
        ):
            continue
        for key in (right := make_arguments(thing)):
            for value in WRONG:
                signal.alarm(PATIENCE)
                try:
                    thing(**right | {key: value})
                except FeelerError:
                    pass
                except Exception as error:
                    foreign.append((name, key, repr(error)))
                finally:
                    signal.alarm(0)
    assert foreign == []
