"""Active touch as off-the-shelf learners know it: flat numbers in, flat numbers out."""

import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from feeler.active.show import _draw_lane
from feeler.active.tasks import SAMPLE, ActiveTask, Arena, FollowTask, LocaliseTask, TouchTask
from feeler.errors import InvalidInput, MissingDependencyError, ModelValidityWarning
from feeler.validation import checked

# Gymnasium environments of active touch, one episode or many side by side, in the manner of
# ap_gym's ActivePerceptionEnv.
#
# To import this module makes them known: ``gymnasium.make("feeler/Touch-v0")``,
# ``"feeler/Localise-v0"``, ``"feeler/FollowWall-v0"``, and ``gymnasium.make_vec`` for many in
# SIMD lanes. ``plain=True``, or the names ``"feeler/PlainTouch-v0"`` and so on, give the form
# that Stable-Baselines3 and CleanRL take: a Box in, a flat Box out
# (:mod:`feeler.active.environment`).

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.utils import seeding
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise MissingDependencyError(
        "environments need gymnasium: pip install 'feeler[active]'."
    ) from error

TASKS: dict[str, type[ActiveTask]] = {
    "feeler/Touch-v0": TouchTask,
    "feeler/Localise-v0": LocaliseTask,
    "feeler/FollowWall-v0": FollowTask,
}


class TouchVectorEnv(VectorEnv):
    """Episodes of one task in SIMD lanes; lane k of ``reset(seed=s)`` is the single environment of
    seed s + k, bit for bit.

    An action is ``{"action": (speed [mm/ms], turn [rad/ms]), "prediction": …}``, with
    ``decide=True`` also ``"decide"``: 1 ends the episode. A step takes 1 ms. The reward is
    ``base_reward`` (−``time_cost`` per ms, −``work_cost`` per µJ) less the loss of the prediction.
    ``info["prediction"]`` holds ``target`` and ``loss``, ``info["touching"]`` and ``info["work"]``
    [µJ] what the body is not told. ``info["valid"]`` is whether no contact of the episode has sunk
    in by more than half of the smaller radius, beyond which forces are not those of solid bodies;
    the first time, one warning says so. Lanes that ended begin anew with the next step, as
    Gymnasium's ``NEXT_STEP`` has it; a lane that diverged is truncated, and ``info["failed"]`` says
    why.

    Parameters
    ----------
    task
        What is met, felt, asked and charged.
    num_envs, workers
        Lanes, and the threads over which they are spread.
    decide
        Whether the body may end its episode.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium has it so
        "render_modes": ["rgb_array"],
        "render_fps": 15,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        task: ActiveTask,
        num_envs: int = 1,
        *,
        decide: bool = False,
        workers: int = 1,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InvalidInput(f"render_mode is 'rgb_array' or None, got {render_mode!r}.")
        self.task, self.num_envs, self.render_mode = task, num_envs, render_mode
        self._decide = decide
        self.arena = Arena(task, num_envs, workers)
        self.single_observation_space = spaces.Dict(
            {name: _make_box(each.shape[1:]) for name, each in self.arena.observe().items()}
        )
        limits = np.array([task.max_speed, task.max_turn])
        action = {
            "action": spaces.Box(-limits, limits, dtype=np.float64),
            "prediction": _make_box((task.n_outputs,)),
        }
        self.single_action_space = spaces.Dict(
            action | ({"decide": spaces.Discrete(2)} if decide else {})
        )
        self.single_prediction_target_space = (
            spaces.Discrete(task.n_outputs) if task.n_outputs > 1 else _make_box(())
        )
        for kind in ("observation", "action", "prediction_target"):
            space = batch_space(getattr(self, f"single_{kind}_space"), num_envs)
            setattr(self, f"{kind}_space", space)
        self.loss_fn: Callable[[np.ndarray, np.ndarray], np.ndarray] = task.compute_loss
        self._ended = np.zeros(num_envs, bool)
        self._before = np.zeros(num_envs)
        self.arena.simulations.quiet, self._warned = True, False
        self._rngs: list[np.random.Generator] = []

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begin an episode in every lane, or in those of ``options["reset_mask"]``.

        ``options["touch"]``: number of the touch among ``task.trials`` in place of one that is
        drawn.
        """
        options = options or {}
        if isinstance(seed, list):
            seeds = seed
        else:
            seeds = [None if seed is None else seed + k for k in range(self.num_envs)]
        old: list[Any] = self._rngs or [None] * self.num_envs
        self._rngs = [
            seeding.np_random(given)[0] if rng is None or given is not None else rng
            for rng, given in zip(old, seeds, strict=True)
        ]
        mask = np.asarray(options.get("reset_mask", np.ones(self.num_envs, bool)))
        for lane in np.flatnonzero(mask):
            self._begin(int(lane), options.get("touch"))
        return self.arena.observe(), self._inform()

    def _begin(self, lane: int, touch: int | None = None) -> None:
        start = None
        if touch is not None and isinstance(self.task, TouchTask):
            start = self.task.make_start(touch)
        self.arena.begin(lane, self._rngs[lane], start)
        self._ended[lane], self._before[lane] = False, 0.0

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Go on by a millisecond.

        Raises
        ------
        InvalidInput
            Not begun yet, or an action that is no member of the space; the message names the lane,
            and nothing has moved.
        """
        if not self._rngs:
            raise InvalidInput("call reset() before the first step().")
        move, prediction = self._read(actions)
        decided = np.zeros(self.num_envs, bool)
        if self._decide:
            decided = np.asarray(actions["decide"]).reshape(self.num_envs).astype(bool)
        before, reward = self._ended, np.zeros(self.num_envs)
        terminated, truncated, info = self._advance(move, prediction, decided, ~before, reward)
        self._begin_anew(before, info)
        return self.arena.observe(), reward, terminated, truncated, info

    def _begin_anew(self, ended: np.ndarray, info: dict[str, Any]) -> None:
        """Begin an episode in the lanes that ended before this step."""
        for lane in np.flatnonzero(ended):
            self._begin(int(lane))
        if ended.any():
            now, loss = self._inform(), info["prediction"]["loss"]
            info.pop("failed", None)
            info.update(now)
            info["prediction"]["loss"] = loss

    def _advance(
        self,
        move: np.ndarray,
        prediction: np.ndarray,
        decided: np.ndarray,
        here: np.ndarray,
        reward: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
        """Take a millisecond in the lanes ``here`` and add to their ``reward``: terminated,
        truncated, info.
        """
        task = self.task
        self.arena.step(move, np.flatnonzero(here))
        target = self.arena.targets
        failed = np.array([error is not None for error in self.arena.failed])
        loss = task.compute_loss(prediction, target)
        spent = task.work_cost * (self.arena.work - self._before)
        base_reward = -task.time_cost * SAMPLE - spent - task.compute_cost(target)
        self._before = self.arena.work.copy()
        terminated = here & (decided | np.array([task.is_over(value) for value in target]))
        truncated = here & (self.arena.over | failed)
        self._ended = terminated | truncated
        info = self._inform() | {"base_reward": np.where(here, base_reward, 0.0)}
        info["prediction"] = {"target": target, "loss": np.where(here, loss, 0.0)}
        reward += np.where(here, base_reward - loss, 0.0)
        return terminated, truncated, info

    def _read(self, actions: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Moves (lane, 2) and predictions (lane, output)."""
        keys = ("action", "prediction", "decide")[: 2 + self._decide]
        if not isinstance(actions, Mapping) or {*keys} - {*actions}:
            raise InvalidInput(
                f"an action has the keys {', '.join(keys)}, got {str(actions)[:80]}."
            )
        prediction = np.asarray(actions["prediction"], dtype=float)
        wanted = (self.num_envs, self.task.n_outputs)
        if prediction.shape != wanted or not np.isfinite(prediction).all():
            wrong = np.argwhere(~np.isfinite(prediction))
            lane = f" in lane {wrong[0][0]}" if prediction.shape == wanted else ""
            raise InvalidInput(
                f"a prediction is finite numbers {wanted}, got {prediction.shape}{lane}."
            )
        return self.arena.check_action(np.asarray(actions["action"], dtype=float)), prediction

    def _inform(self) -> dict[str, Any]:
        target = self.arena.targets
        info: dict[str, Any] = {"touching": self.arena.touching, "work": self.arena.work.copy()}
        info["prediction"] = {"target": target, "loss": np.zeros(self.num_envs)}
        info["valid"] = valid = self.arena.valid
        if not self._warned and not valid.all():
            self._warned = True
            warnings.warn(
                "a contact penetrates by more than half of the smaller radius, where forces are not"
                " those of solid bodies; info['valid'] names such episodes from now on. Give"
                " max_speed= and max_turn= to the task to keep away from it.",
                ModelValidityWarning,
                stacklevel=2,
            )
        if any(self.arena.failed):
            info["failed"] = np.array(
                [str(error or "") for error in self.arena.failed], dtype=object
            )
        return info

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture (height, width, 3) of every lane."""
        if self.render_mode is None:
            return None
        return tuple(_draw_lane(self.arena, lane) for lane in range(self.num_envs))


class TouchEnv(gymnasium.Env):
    """One episode at a time; the same words as :class:`TouchVectorEnv`, without the lanes."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 15}  # noqa: RUF012

    def __init__(
        self, task: ActiveTask, *, decide: bool = False, render_mode: str | None = None
    ) -> None:
        self.lanes = TouchVectorEnv(task, 1, decide=decide, render_mode=render_mode)
        self.task, self.render_mode = task, render_mode
        self.observation_space = self.lanes.single_observation_space
        self.action_space = self.lanes.single_action_space
        self.prediction_target_space = self.lanes.single_prediction_target_space
        self.loss_fn = task.compute_loss

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Begin an episode; ``options["touch"]`` says which touch it is."""
        super().reset(seed=seed)
        self.lanes._rngs = [self.np_random]
        observation, info = self.lanes.reset(options=options)
        return _first(observation), _first(info)

    def step(
        self, action: Mapping[str, Any]
    ) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Go on by a millisecond; errors as in :meth:`TouchVectorEnv.step`, and after the end."""
        if self.lanes._ended[0]:
            raise InvalidInput("the episode has ended; call reset().")
        action = action if isinstance(action, Mapping) else {}
        given = {key: np.asarray(value)[None] for key, value in action.items()}
        observation, reward, terminated, truncated, info = self.lanes.step(given)
        ends = bool(terminated[0]), bool(truncated[0])
        return _first(observation), float(reward[0]), *ends, _first(info)

    def render(self) -> np.ndarray | None:
        """A picture (height, width, 3)."""
        return (self.lanes.render() or (None,))[0]


def _first(values: Mapping[str, Any]) -> dict[str, Any]:
    """Lane 0 of everything."""
    return {
        name: _first(value) if isinstance(value, Mapping) else np.asarray(value)[0]
        for name, value in values.items()
    }


def _make_box(shape: tuple[int, ...]) -> Any:
    return spaces.Box(-np.inf, np.inf, shape, np.float64)


def make_env(name: str, plain: bool = False, **fields: Any) -> gymnasium.Env:
    """What ``gymnasium.make(name)`` calls; ``fields`` are the task's, or ``decide`` and
    ``render_mode``, and of the plain form ``repeat`` and ``span``.
    """

    own = {key: fields.pop(key) for key in ("decide", "render_mode") if key in fields}
    form = {key: fields.pop(key) for key in ("repeat", "span") if plain and key in fields}
    env = TouchEnv(_make_task(name, fields), **own)
    return PlainTouch(env, **form) if plain else env


def make_vector_env(
    name: str, num_envs: int = 1, plain: bool = False, **fields: Any
) -> "TouchVectorEnv | PlainVectorEnv":
    """What ``gymnasium.make_vec(name, num_envs)`` calls; beside the task's fields ``decide``,
    ``workers``, ``render_mode``, and of the plain form ``repeat`` and ``span``.
    """
    form = {key: fields.pop(key) for key in ("repeat", "span") if plain and key in fields}
    own = {
        key: fields.pop(key) for key in ("decide", "workers", "render_mode") if key in fields
    }
    lanes = TouchVectorEnv(_make_task(name, fields), num_envs, **own)
    return PlainVectorEnv(lanes, **form) if plain else lanes


def _make_task(name: str, fields: dict[str, Any]) -> ActiveTask:
    task = fields.pop("task", None)
    if task is None:
        return TASKS[name](**fields)
    if fields:
        raise InvalidInput("give either task= or its fields, not both.")
    return task


for name in TASKS:
    if name not in gymnasium.registry:
        gymnasium.register(
            name,
            entry_point="feeler.active.environment:make_env",
            vector_entry_point="feeler.active.environment:make_vector_env",
            kwargs={"name": name},
        )
        gymnasium.register(
            name.replace("/", "/Plain"),
            entry_point="feeler.active.environment:make_env",
            vector_entry_point="feeler.active.environment:make_vector_env",
            kwargs={"name": name, "plain": True},
        )


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
        self._lanes = PlainVectorEnv(env.unwrapped.lanes, repeat, span)
        self.observation_space = self._lanes.single_observation_space
        self.action_space = self._lanes.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; the words are the environment's."""
        _, info = self.env.reset(seed=seed, options=options)
        return self._lanes.observe()[0], info

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold one action for ``repeat`` ms; numbers beyond [−1, 1] count as the end they pass."""
        if self._lanes.lanes._ended[0]:
            raise InvalidInput("the episode has ended; call reset().")
        observation, reward, terminated, truncated, info = self._lanes.step(
            np.asarray(action, dtype=float)[None]
        )
        ends = bool(terminated[0]), bool(truncated[0])
        return observation[0], float(reward[0]), *ends, _first(info)


class PlainVectorEnv(VectorEnv):
    """The plain form of many environments in SIMD lanes, with the numbers of
    :class:`PlainTouch` alone: what ``gymnasium.make_vec("feeler/PlainTouch-v0", 64)`` makes.

    Lanes that ended begin anew with the next step, as Gymnasium's ``NEXT_STEP`` has it.

    Parameters
    ----------
    lanes
        A :class:`TouchVectorEnv`.
    repeat, span
        As of :class:`PlainTouch`.
    """

    metadata: dict[str, Any] = TouchVectorEnv.metadata

    def __init__(
        self, lanes: TouchVectorEnv, repeat: int = _REPEAT, span: float = _SPAN
    ) -> None:
        self.lanes, self.num_envs, self.render_mode = lanes, lanes.num_envs, lanes.render_mode
        self._repeat, self._span = max(repeat, 1), span
        size = spaces.flatdim(lanes.single_observation_space)
        n = 2 + lanes.task.n_outputs + lanes._decide
        self.single_observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.single_action_space = spaces.Box(-1.0, 1.0, (n,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def observe(self) -> np.ndarray:
        """What the bodies know now (lane, number)."""
        seen = self.lanes.arena.observe()
        names = self.lanes.single_observation_space.spaces  # type: ignore[attr-defined]
        rows = [np.asarray(seen[name]).reshape(self.num_envs, -1) for name in names]
        return np.concatenate(rows, axis=1).astype(np.float32)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes; the words are those of :meth:`TouchVectorEnv.reset`."""
        _, info = self.lanes.reset(seed=seed, options=options)
        return self.observe(), info

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold the actions (lane, number) for ``repeat`` ms; numbers beyond [−1, 1] count as the
        end they pass.
        """
        lanes, task = self.lanes, self.lanes.task
        if not lanes._rngs:
            raise InvalidInput("call reset() before the first step().")
        given = np.clip(np.asarray(actions, dtype=float), -1.0, 1.0)
        n = 2 + task.n_outputs
        wanted = (self.num_envs, n + lanes._decide)
        if given.shape != wanted or not np.isfinite(given).all():
            raise InvalidInput(f"actions are finite numbers {wanted}, got {given.shape}.")
        move = given[:, :2] * [task.max_speed, task.max_turn]
        prediction = self._span * given[:, 2:n]
        decided = given[:, -1] > 0 if lanes._decide else np.zeros(self.num_envs, bool)
        before, reward = lanes._ended, np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), bool)
        here = ~before
        loss: np.ndarray = np.zeros(self.num_envs)
        info: dict[str, Any] = lanes._inform()
        for _ in range(self._repeat):
            if not here.any():
                break
            ended, cut, info = lanes._advance(move, prediction, decided, here, reward)
            loss = np.where(here, info["prediction"]["loss"], loss)
            terminated, truncated = terminated | ended, truncated | cut
            here = here & ~(ended | cut)
        lanes._ended = terminated | truncated
        info["prediction"]["loss"] = loss
        lanes._begin_anew(before, info)
        return self.observe(), reward, terminated, truncated, info

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture (height, width, 3) of every lane."""
        return self.lanes.render()
