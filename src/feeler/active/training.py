"""A learned policy: recurrent PPO of stable-baselines3 on what a decoder believes. Needs ``sb3-contrib``."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import log_softmax, softmax

from feeler.active.arena import Arena
from feeler.active.observer import PERIOD
from feeler.active.recurrent import RecurrentDecoder
from feeler.active.task import SAMPLE, TouchTask
from feeler.checked import checked
from feeler.errors import MissingExtra
from feeler.tensors.models import Model, save_model

CELLS = 64  # [C] of the policy; the default of 256 takes four times as long
WAY = 20.0  # mm, by which the way is divided
Chooser = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""From what bodies see (lane, number), and whether each has just begun (lane,), to their speeds over ``max_speed`` (lane,)."""


class Deciders:
    """Bodies in lanes that decide every few milliseconds, each knowing its decoder's beliefs, its way, speed and time.

    The reward of a decision is the log-probability of the truth at its end, over the number of decisions, less that of one who
    knows nothing.
    """

    def __init__(self, task: TouchTask, decoder: RecurrentDecoder, lanes: int, seed: int) -> None:
        decoder.check(task)
        self.task, self.decoder, self.arena = task, decoder, Arena(task, lanes)
        self.rngs = [np.random.default_rng([seed, lane]) for lane in range(lanes)]
        self.n_decisions, self.decided = round(task.duration / PERIOD), 0
        self.begin()

    def begin(self) -> np.ndarray:
        """Begin an episode in every lane; what the bodies see."""
        for lane, rng in enumerate(self.rngs):
            self.arena.begin(lane, rng)
        self.decided, self.state = 0, None
        self.score = np.zeros((self.arena.n, self.task.n_outputs))
        return self.see()

    def see(self) -> np.ndarray:
        """Beliefs, way, speed and time (lane, object + 3), each about one in size."""
        base, time = self.arena.reading.base, self.arena.reading.time
        own = np.stack([base[:, 0] / WAY, base[:, 2] / self.task.max_speed, time[:, 0] / self.task.duration], axis=1)
        return np.concatenate([softmax(self.score, axis=1), own], axis=1).astype(np.float32)

    def step(self, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Go on by a decision at speeds (lane,) in [−1, 1] of the greatest; what is seen, the rewards, and whether it is over."""
        action = np.stack([np.clip(speed, -1, 1) * self.task.max_speed, np.zeros(self.arena.n)], axis=1)
        felt, base = [], []
        for _ in range(round(PERIOD / SAMPLE)):
            self.arena.step(action)
            reading = self.arena.reading
            felt.append(reading.angle[:, -1])
            base.append(reading.base)
        scores, self.state = self.decoder.score(np.stack(felt, axis=1), np.stack(base, axis=1), self.state)
        self.score = scores[:, -1] / self.decoder.temperature
        self.decided += 1
        likely = np.take_along_axis(log_softmax(self.score, axis=1), self.arena.targets.astype(int)[:, None], 1)[:, 0]
        reward = (likely + np.log(self.task.n_outputs)) / self.n_decisions
        return self.see(), reward, self.decided == self.n_decisions


def _make_vec_env(deciders: Deciders) -> Any:
    from gymnasium import spaces
    from stable_baselines3.common.vec_env import VecEnv

    class Lanes(VecEnv):
        """Deciders as stable-baselines3 wants them."""

        def __init__(self) -> None:
            n = deciders.task.n_outputs + 3
            seen = spaces.Box(-np.inf, np.inf, (n,), np.float32)
            super().__init__(deciders.arena.n, seen, spaces.Box(-1.0, 1.0, (1,), np.float32))

        def reset(self) -> np.ndarray:
            return deciders.begin()

        def step_async(self, actions: np.ndarray) -> None:
            self.actions = actions[:, 0]

        def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
            seen, reward, over = deciders.step(self.actions)
            infos = [{"terminal_observation": one} if over else {} for one in seen]
            return deciders.begin() if over else seen, reward.astype(np.float32), np.full(len(reward), over), infos

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
    task: TouchTask, decoder: RecurrentDecoder, *, steps: int = 30_000, lanes: int = 32, seed: int = 0
) -> Any:
    """Train recurrent PPO for so many decisions over all lanes; stable-baselines3's defaults otherwise.

    Raises
    ------
    MissingExtra
        sb3-contrib is not installed.
    """
    try:
        from sb3_contrib import RecurrentPPO
    except ImportError as error:
        raise MissingExtra("a learned policy needs sb3-contrib: pip install sb3-contrib.") from error
    env = _make_vec_env(Deciders(task, decoder, lanes, seed))
    episode = round(task.duration / PERIOD)
    model = RecurrentPPO(
        "MlpLstmPolicy",
        env,
        policy_kwargs={"lstm_hidden_size": CELLS},
        n_steps=2 * episode,
        batch_size=2 * episode * lanes // 4,
        seed=seed,
        device="cpu",
    )
    return model.learn(steps)


def make_learned(model: Any) -> Chooser:
    """What a trained model does, without exploring."""
    kept: list[Any] = [None]

    def choose(seen: np.ndarray, begun: np.ndarray) -> np.ndarray:
        action, kept[0] = model.predict(seen, None if begun.all() else kept[0], begun, deterministic=True)
        return action[:, 0]

    return choose


@checked
def measure_deciders(
    task: TouchTask,
    decoder: RecurrentDecoder,
    choose: Callable,
    deadlines: Sequence[float],
    *,
    n: int = 1024,
    lanes: int = 64,
    seed: int = 1000,
) -> tuple[np.ndarray, np.ndarray]:
    """Let ``n`` bodies decide; whether the decoder's answer is right (episode, deadline), and the reward of each (episode,)."""
    deciders, rights, rewards = Deciders(task, decoder, min(lanes, n), seed), [], []
    ends = [round(deadline / PERIOD) for deadline in deadlines]
    for _ in range(-(-n // deciders.arena.n)):
        seen, over, total, right = deciders.begin(), False, np.zeros(deciders.arena.n), []
        begun = np.ones(deciders.arena.n, bool)
        while not over:
            seen, reward, over = deciders.step(np.asarray(choose(seen, begun)))
            begun, total = np.zeros(len(begun), bool), total + reward
            right.append(deciders.score.argmax(axis=1) == deciders.arena.targets)
        rights.append(np.array(right)[[end - 1 for end in ends]].T)
        rewards.append(total)
    return np.concatenate(rights)[:n], np.concatenate(rewards)[:n]


def save_policy(model: Any, path: Path | str, settings: dict[str, Any]) -> None:
    """Write a trained policy's configuration and weights as safetensors."""
    arrays = {name: value.detach().numpy() for name, value in model.policy.state_dict().items()}
    save_model(Model(kind="RecurrentPPO", version=1, arrays=arrays, settings=settings), path)
