"""Active touch as off-the-shelf learners know it: flat numbers in, flat numbers out."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from feeler.records.checked import checked

_REPEAT = (
    10  # [C] ms that one action lasts; a learner that moves every ms explores by trembling
)
_SPAN = 5.0  # [C] largest prediction: a logit of 5 is 99 % against 0


class PlainTouch(gymnasium.Wrapper):
    """An environment of active touch with Boxes of single precision.

    The action is one vector in [−1, 1]: speed and turn as shares of the task's largest, the
    predictions as shares of ``span``, and with ``decide=True`` one number that ends the episode
    where it is > 0. The observation is all that the body feels in one vector, in the order of its
    names. The reward is the sum over the milliseconds of one action.

    Parameters
    ----------
    env
        A :class:`feeler.active.environment.TouchEnv`.
    repeat
        Steps of 1 ms that each action is held.
    span
        What a prediction of 1 stands for: a logit, or the task's own unit.
    """

    @checked
    def __init__(self, env: Any, repeat: int = _REPEAT, span: float = _SPAN) -> None:
        super().__init__(env)
        self._repeat, self._span = max(repeat, 1), span
        self._task = env.unwrapped.task
        self._limits = np.array([self._task.max_speed, self._task.max_turn])
        self._decides = "decide" in env.action_space.spaces
        size = spaces.flatdim(env.observation_space)
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = spaces.Box(
            -1.0, 1.0, (2 + self._task.n_outputs + self._decides,), np.float32
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; the words are the environment's."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._flatten(observation), info

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold one action for ``repeat`` ms; numbers beyond [−1, 1] count as the end they pass."""
        given = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        n = self._task.n_outputs
        told: dict[str, Any] = {
            "action": self._limits * given[:2],
            "prediction": self._span * given[2 : 2 + n],
        }
        if self._decides:
            told["decide"] = int(given[-1] > 0)
        total = 0.0
        for _ in range(self._repeat):
            observation, reward, terminated, truncated, info = self.env.step(told)
            total += float(reward)
            if terminated or truncated:
                break
        return self._flatten(observation), total, terminated, truncated, info

    def _flatten(self, observation: Any) -> np.ndarray:
        flat = spaces.flatten(self.env.observation_space, observation)
        return np.asarray(flat, dtype=np.float32)
