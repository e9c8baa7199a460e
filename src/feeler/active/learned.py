"""The learned policy: what recurrent PPO made of the observer's beliefs, as stored weights that
NumPy runs.
"""

from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import numpy as np
from scipy.special import expit

from feeler.active.observer import MENU, Known, Policy
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.models import Model, load_model

POLICY_KIND, POLICY_VERSION = "LearnedPolicy", 1
_WAY, _FAST, _LONG = (
    20.0,
    1.2,
    150.0,
)  # mm, mm/ms, ms: what numbers are divided by, to be about one in size
OWN = 6  # numbers beside the beliefs


def see(known: Known, deadline: float) -> np.ndarray:
    """What a policy is told (body, number), each about one in size: belief in each object, their
    entropy, the probability that contact has begun, way, speed, time gone and time left."""
    n, classes = known.belief.shape
    entropy = -(known.belief * np.log(np.maximum(known.belief, 1e-300))).sum(axis=1) / np.log(
        classes
    )
    time = np.full(n, known.time / _LONG), np.full(n, max(deadline - known.time, 0.0) / _LONG)
    own = np.stack(
        [entropy, known.touching, known.way / _WAY, known.speed / _FAST, *time], axis=1
    )
    return np.concatenate([known.belief, own], axis=1).astype(np.float32)


def make_actor(arrays: dict[str, np.ndarray], deadline: float) -> Policy:
    """The policy of an actor's weights: an LSTM, two layers of tanh, and the speed of the menu with
    the greatest score.
    """
    state: list[np.ndarray] = []
    wanted = arrays["lstm_actor.weight_ih_l0"].shape[1]

    def choose(known: Known) -> np.ndarray:
        seen = see(known, deadline)
        if seen.shape[1] != wanted:
            raise InvalidInput(
                f"this policy was learned for {wanted - OWN} objects, the task has"
                f" {seen.shape[1] - OWN}. Train one for it with benchmarks/active_learning.py."
            )
        if known.time == 0:
            state[:] = [
                np.zeros((len(seen), arrays["lstm_actor.weight_hh_l0"].shape[1]), np.float32)
            ] * 2
        state[:] = _remember(arrays, seen, *state)
        hidden = state[0]
        for layer in ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2"):
            hidden = np.tanh(hidden @ arrays[f"{layer}.weight"].T + arrays[f"{layer}.bias"])
        scores = hidden @ arrays["action_net.weight"].T + arrays["action_net.bias"]
        return np.array(MENU)[scores.argmax(axis=1)]

    return choose


def _remember(
    arrays: dict[str, np.ndarray], seen: np.ndarray, hidden: np.ndarray, cell: np.ndarray
) -> list[np.ndarray]:
    """One step of the LSTM, its gates in PyTorch's order."""
    name = "lstm_actor.{}_l0".format
    gates = seen @ arrays[name("weight_ih")].T + arrays[name("bias_ih")]
    gates = gates + hidden @ arrays[name("weight_hh")].T + arrays[name("bias_hh")]
    into, keep, new, out = np.split(gates, 4, axis=1)
    cell = expit(keep) * cell + expit(into) * np.tanh(new)
    return [expit(out) * np.tanh(cell), cell]


def find_weights(seed: Annotated[int, "≥ 0"]) -> Path:
    """Where the weights of a seed are kept with the package."""
    with as_file(files("feeler.active")) as folder:
        return Path(folder) / f"learned{seed}.safetensors"


_MAX_SEED = 2**32  # no file of the package has a longer name


@lru_cache(maxsize=8)
def _load(seed: Annotated[int, "≥ 0"]) -> Model:
    path = find_weights(seed)
    if seed > _MAX_SEED or not path.is_file():
        known = sorted(
            file.stem.removeprefix("learned")
            for file in path.parent.glob("learned*.safetensors")
        )
        raise InvalidInput(
            f"no policy was learned with seed {seed}; there are: {', '.join(known) or 'none'}."
        )
    return load_model(path, kind=POLICY_KIND, version=POLICY_VERSION, trusted=True)


@checked
def make_learned(
    seed: Annotated[float, "≥ 0"] = 0.0, deadline: Annotated[float, "> 0"] = 50.0
) -> Policy:
    """What recurrent PPO learned with a seed, told that it is asked at a deadline [ms]."""
    return make_actor(_load(int(seed)).arrays, deadline)
