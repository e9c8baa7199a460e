"""Training of the learned policy: recurrent PPO of stable-baselines3 on what an observer believes.
Needs ``sb3-contrib``.

A body decides every 5 ms; it is told :func:`feeler.active.learned.see`. Each decision earns by how
much the greatest belief has risen, so that an episode earns the belief in the verdict at its
deadline, less what guessing is worth: the mean, over an exact posterior, of 1 for a right verdict
and 0 for a wrong one.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from feeler.active.learned import KIND, OWN, VERSION, make_actor, see
from feeler.active.observer import MENU, Policy
from feeler.active.practice import Practice, Practised
from feeler.checked import checked
from feeler.errors import InvalidInput, MissingExtra
from feeler.tensors.models import Model, save_model

ACTOR = (
    "lstm_actor.",
    "mlp_extractor.policy_net.",
    "action_net.",
)  # what moves the body; the critic is not kept


def _make_vec_env(
    practices: Sequence[Practice], deadlines: Sequence[float], groups: int, seed: int
) -> Any:
    from gymnasium import spaces
    from stable_baselines3.common.vec_env import VecEnv

    rng, each, menu = np.random.default_rng(seed), len(practices[0].label), np.array(MENU)

    def begin() -> Practised:
        deadline = float(rng.choice(deadlines))
        return Practised(practices[int(rng.integers(len(practices)))], deadline, rng)

    class Lanes(VecEnv):
        """Groups of bodies, each with touches and a deadline of its own, as stable-baselines3 wants
        them.
        """

        def __init__(self) -> None:
            seen = spaces.Box(-np.inf, np.inf, (practices[0].task.n_outputs + OWN,), np.float32)
            super().__init__(groups * each, seen, spaces.Discrete(len(menu)))

        def reset(self) -> np.ndarray:
            self.groups = [begin() for _ in range(groups)]
            return np.concatenate([see(one.known, one.deadline) for one in self.groups])

        def step_async(self, actions: np.ndarray) -> None:
            self.chosen = menu[actions].reshape(groups, each)

        def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
            rewards, over, infos, seen = [], [], [], []
            for k, (one, speed) in enumerate(zip(self.groups, self.chosen, strict=True)):
                before = one.known.belief.max(axis=1)
                known = one.step(speed)
                rewards.append(known.belief.max(axis=1) - before)
                over.append(np.full(each, known.left <= 0))
                last = see(known, one.deadline)
                infos += [{"terminal_observation": row} if known.left <= 0 else {} for row in last]
                if known.left <= 0:
                    self.groups[k] = one = begin()
                    last = see(one.known, one.deadline)
                seen.append(last)
            return (
                np.concatenate(seen),
                np.concatenate(rewards).astype(np.float32),
                np.concatenate(over),
                infos,
            )

        def close(self) -> None:
            pass

        def _say_nothing(self, *_args: Any, **_kwargs: Any) -> list[Any]:
            return [None] * self.num_envs

        get_attr: Any = _say_nothing
        set_attr: Any = _say_nothing
        env_method: Any = _say_nothing
        env_is_wrapped: Any = _say_nothing

    return Lanes()


@checked
def train_policy(
    practices: Sequence[Practice],
    deadlines: Sequence[float],
    *,
    steps: int,
    groups: int = 4,
    cells: int = 32,
    rate: float = 1e-3,
    rollout: int = 32,
    batches: int = 4,
    entropy: float = 0.0,
    seed: int = 0,
) -> Any:
    """Train recurrent PPO for so many decisions over all bodies.

    Parameters
    ----------
    practices
        Sets of touches of one size, of which each group of bodies draws one an episode, and one of
        the ``deadlines`` [ms].
    rollout, batches
        Decisions of a body between two updates, and into how many parts an update is cut.
    entropy
        What an action that is hard to foresee earns. The rest is stable-baselines3's default, but
        that nothing is discounted.

    Raises
    ------
    InvalidInput
        Nothing to practise on.
    MissingExtra
        sb3-contrib is not installed.
    """
    if not practices or not deadlines or len({len(one.label) for one in practices}) > 1:
        raise InvalidInput(
            "to train, give practices of equally many touches, at least one, and a deadline [ms]."
        )
    try:
        import torch
        from sb3_contrib import RecurrentPPO
    except ImportError as error:
        raise MissingExtra(
            "to learn a policy needs sb3-contrib: pip install 'feeler[active]'."
        ) from error
    torch.set_num_threads(1)  # so small a network is slower on more
    env = _make_vec_env(practices, deadlines, groups, seed)
    model = RecurrentPPO(
        "MlpLstmPolicy",
        env,
        learning_rate=rate,
        n_steps=rollout,
        batch_size=rollout * env.num_envs // batches,
        gamma=1.0,
        ent_coef=entropy,
        policy_kwargs={"lstm_hidden_size": cells},
        seed=seed,
        device="cpu",
    )
    return model.learn(steps)


def read_actor(model: Any) -> dict[str, np.ndarray]:
    """Weights of the part of a trained model that moves the body."""
    state = model.policy.state_dict()
    return {name: value.detach().numpy() for name, value in state.items() if name.startswith(ACTOR)}


def make_trained(model: Any, deadline: float) -> Policy:
    """The policy of a trained model, without exploring."""
    return make_actor(read_actor(model), deadline)


def save_policy(model: Any, path: Path | str, settings: dict[str, Any]) -> None:
    """Write a trained policy's configuration and weights as safetensors."""
    save_model(Model(kind=KIND, version=VERSION, arrays=read_actor(model), settings=settings), path)
