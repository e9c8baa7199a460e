"""Environments in SIMD lanes for Stable-Baselines3."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from feeler.active.environment import make_vector_env
from feeler.errors import MissingDependencyError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    words = "this adapter needs Stable-Baselines3: pip install stable-baselines3."
    raise MissingDependencyError(words) from error


class TouchVecEnv(VecEnv):
    """What Stable-Baselines3 takes in place of an environment: many plain ones in SIMD lanes.

    Lanes that end begin anew within the same step, as Stable-Baselines3 has it; ``infos`` then hold
    ``terminal_observation`` and ``TimeLimit.truncated``, and always ``loss`` and ``valid``.

    Parameters
    ----------
    name
        Such as ``feeler/Touch-v0``.
    num_envs
        Lanes.
    fields
        The task's, and ``repeat``, ``span``, ``decide``, ``workers``, ``render_mode``.

    Examples
    --------
    >>> from feeler.active.sb3 import TouchVecEnv
    >>> envs = TouchVecEnv("feeler/Touch-v0", 16, duration=60.0, max_speed=0.6)
    >>> envs.reset().shape[0]
    16
    """

    def __init__(self, name: str, num_envs: int = 64, **fields: Any) -> None:
        made = make_vector_env(name, num_envs, **fields)
        self.lanes, self.render_mode = made, made.render_mode
        super().__init__(num_envs, made.single_observation_space, made.single_action_space)
        self._actions: np.ndarray = np.zeros(0)

    def reset(self) -> np.ndarray:
        """Begin an episode in every lane."""
        seeds = [None if seed is None else int(seed) for seed in self._seeds]
        observation, _ = self.lanes.reset(seed=seeds)
        self._reset_seeds()
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Take the step."""
        observation, reward, terminated, truncated, info = self.lanes.step(self._actions)
        done, loss, valid = terminated | truncated, info["prediction"]["loss"], info["valid"]
        infos: list[dict[str, Any]] = [
            {"loss": float(a), "valid": bool(b)} for a, b in zip(loss, valid, strict=True)
        ]
        if done.any():
            for lane in np.flatnonzero(done):
                infos[lane]["terminal_observation"] = observation[lane]
                infos[lane]["TimeLimit.truncated"] = bool(
                    truncated[lane] and not terminated[lane]
                )
            observation, _ = self.lanes.reset(options={"reset_mask": done})
        return observation, reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Let go of the lanes."""
        self.lanes.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the lanes, once for each."""
        return [getattr(self.lanes, attr_name)] * len(self._list(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all lanes."""
        setattr(self.lanes, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: Any = None, **options: Any
    ) -> list[Any]:
        """What a method of the lanes returns, once for each."""
        return [getattr(self.lanes, method_name)(*args, **options)] * len(self._list(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No lane is wrapped."""
        return [False] * len(self._list(indices))

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of every lane."""
        return self.lanes.render() or [None] * self.num_envs

    def _list(self, indices: Any) -> Sequence[int]:
        return [*self._get_indices(indices)]
