"""Ways to move in order to know; anyone may register one more."""

from collections.abc import Callable
from inspect import signature
from pathlib import Path
from types import ModuleType

import numpy as np

from feeler.active.observer import MENU, Known, Policy
from feeler.disk.files import read_bytes
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.registry import Registry

_MAX_BYTES = 2**20  # [C] of a policy's file
POLICIES: Registry[Callable[..., Policy]] = Registry(
    "policy", {"learned": "feeler.active.learned:make_learned"}
)
"""What makes each policy, by name; ``POLICIES.register(name, make)`` adds one. Arguments are
numbers.
"""


@POLICIES.register("fixed")
def _make_fixed(speed: float = 0.3) -> Policy:
    """One speed [mm/ms], from the beginning to the end."""
    return lambda known: speed


@POLICIES.register("fast-then-slow")
def _make_fast_then_slow(fast: float = 1.2, slow: float = 0.12, after: float = 10.0) -> Policy:
    """Fast until a time [ms], then slow, whatever is felt."""
    return lambda known: fast if known.time < after else slow


@POLICIES.register("slow-after-contact")
def _make_slow_after_contact(
    fast: float = 1.2, slow: float = 0.12, sure: float = 0.5
) -> Policy:
    """Fast until contact has begun with probability ``sure``, then slow."""
    return lambda known: np.where(known.touching < sure, fast, slow)


@POLICIES.register("random")
def _make_random(seed: float = 0.0, hold: float = 20.0) -> Policy:
    """A speed drawn from the menu every ``hold`` [ms], the same for all bodies."""
    return lambda known: np.random.default_rng([int(seed), int(known.time // hold)]).choice(
        MENU
    )


@POLICIES.register("greedy")
def _make_greedy(hold: float = 20.0) -> Policy:
    """Every ``hold`` [ms] the speed that is expected to tell most about the object within them."""
    speeds = [speed for speed in MENU if speed >= 0.06]
    last = [np.zeros(0)]

    def choose(known: Known) -> np.ndarray:
        if known.time % hold < 1e-9:
            last[0] = np.array(speeds)[known.look(speeds, min(hold, known.left)).argmax(axis=1)]
        return last[0]

    return choose


@checked
def parse_policy(text: str) -> Policy:
    """A policy from ``name``, ``name:number,number`` or ``file.py:function``, whose function takes
    a Known.

    Raises
    ------
    InvalidInput
        No such policy or file, or numbers that do not fit.
    """
    name, _, rest = text.partition(":")
    if name.endswith(".py"):
        return _load(Path(name), rest)
    make = POLICIES[name]
    try:
        return make(*(float(word) for word in rest.split(",") if word))
    except InvalidInput:
        raise
    except (TypeError, ValueError):
        usual = signature(make).parameters.values()
        raise InvalidInput(
            f"{name!r} takes {', '.join(one.name for one in usual)} as numbers, got {rest!r}."
            f" Write it as in {name}:{','.join(f'{one.default:g}' for one in usual)}."
        ) from None


def _load(path: Path, name: str) -> Policy:
    if not path.is_file():
        raise InvalidInput(
            f"there is no file {path}; a policy of your own is file.py:function."
        )
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    # from its text: what Python keeps of a file would hide a change within the same second
    exec(compile(read_bytes(path, _MAX_BYTES), path, "exec"), vars(module))
    found = getattr(module, name or "policy", None)
    if not callable(found):
        raise InvalidInput(
            f"{path} has no function {name or 'policy'!r}; name it as in {path}:function."
        )
    return found
