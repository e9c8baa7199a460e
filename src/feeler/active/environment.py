"""Active touch as off-the-shelf learners know it: flat numbers in, flat numbers out."""

import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from feeler.active.policies import draw_lane
from feeler.active.tasks import SAMPLE, ActiveTask, Arena, FollowTask, LocaliseTask, TouchTask
from feeler.errors import InvalidInput, MissingDependencyError, ModelValidityWarning

# Gymnasium environments of active touch, one episode or many side by side. To import this module
# makes them known: ``gymnasium.make("feeler/Touch-v0")``, ``"feeler/Localise-v0"`` and
# ``"feeler/FollowWall-v0"``, and ``gymnasium.make_vec`` for many in SIMD lanes. They take and give
# flat Boxes, as Stable-Baselines3, CleanRL and skrl do; ``plain=False`` gives dictionaries, in the
# manner of ap_gym's ActivePerceptionEnv.
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

_REPEAT = 10  # [C] ms of one plain action; a learner that moves every ms explores by trembling
_SPAN = 5.0  # [C] largest plain prediction: a logit of 5 is 99 % against 0


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

    With ``plain=True`` actions and observations are Boxes of single precision. The action is one
    vector in [−1, 1]: speed and turn as shares of the task's largest, the predictions as shares of
    ``span``, and with ``decide=True`` one number that ends the episode where it is > 0; numbers
    beyond [−1, 1] count as the end they pass. The observation is all that the body feels in one
    vector, in the order of its names. The reward is the sum over the milliseconds of one action.

    Parameters
    ----------
    task
        What is met, felt, asked and charged.
    num_envs, workers
        Lanes, and the threads over which they are spread.
    decide
        Whether the body may end its episode.
    plain
        Whether actions and observations are flat vectors.
    repeat
        Milliseconds that each action is held; default 1, of plain actions 10.
    span
        What a plain prediction of 1 stands for: a logit, or the task's own unit.
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
        plain: bool = False,
        repeat: int | None = None,
        span: float = _SPAN,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InvalidInput(f"render_mode is 'rgb_array' or None, got {render_mode!r}.")
        self.task, self.num_envs, self.render_mode = task, num_envs, render_mode
        self._decide, self._plain, self._span = decide, plain, span
        self._repeat = max(repeat or (_REPEAT if plain else 1), 1)
        self.arena = Arena(task, num_envs, workers)
        seen = spaces.Dict(
            {name: _make_box(each.shape[1:]) for name, each in self.arena.observe().items()}
        )
        limits = np.array([task.max_speed, task.max_turn])
        action = {
            "action": spaces.Box(-limits, limits, dtype=np.float64),
            "prediction": _make_box((task.n_outputs,)),
        }
        action |= {"decide": spaces.Discrete(2)} if decide else {}
        self._names = [*seen.spaces]  # in the order of Gymnasium, which a flat vector has, too
        self.single_observation_space, self.single_action_space = seen, spaces.Dict(action)
        if plain:
            size, n = spaces.flatdim(seen), 2 + task.n_outputs + decide
            self.single_observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
            self.single_action_space = spaces.Box(-1.0, 1.0, (n,), np.float32)
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

    def observe(self) -> Any:
        """What the bodies feel: arrays by name, or in the plain form one vector for each."""
        seen = self.arena.observe()
        if not self._plain:
            return seen
        rows = [np.asarray(seen[name]).reshape(self.num_envs, -1) for name in self._names]
        return np.concatenate(rows, axis=1).astype(np.float32)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
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
        return self.observe(), self._inform()

    def _begin(self, lane: int, touch: int | None = None) -> None:
        start = None
        if touch is not None and isinstance(self.task, TouchTask):
            start = self.task.make_start(touch)
        self.arena.begin(lane, self._rngs[lane], start)
        self._ended[lane], self._before[lane] = False, 0.0

    def step(
        self, actions: Any
    ) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Go on by a millisecond.

        Raises
        ------
        InvalidInput
            Not begun yet, or an action that is no member of the space; the message names the lane,
            and nothing has moved.
        """
        if not self._rngs:
            raise InvalidInput("call reset() before the first step().")
        move, prediction, decided = self._read(actions)
        before, reward, loss = self._ended, np.zeros(self.num_envs), np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), bool)
        here, info = ~before, self._inform() | {"base_reward": np.zeros(self.num_envs)}
        for _ in range(self._repeat):
            if not here.any():
                break
            ended, cut, info = self._advance(move, prediction, decided, here, reward)
            loss = np.where(here, info["prediction"]["loss"], loss)
            terminated, truncated = terminated | ended, truncated | cut
            here = here & ~(ended | cut)
        self._ended = terminated | truncated
        # an episode begins in the lanes that ended before this step
        for lane in np.flatnonzero(before):
            self._begin(int(lane))
        if before.any():
            info.pop("failed", None)
            info.update(self._inform())
        info["prediction"]["loss"] = loss
        return self.observe(), reward, terminated, truncated, info

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
        info = self._inform() | {"base_reward": np.where(here, base_reward, 0.0)}
        info["prediction"] = {"target": target, "loss": np.where(here, loss, 0.0)}
        reward += np.where(here, base_reward - loss, 0.0)
        return terminated, truncated, info

    def _read(self, actions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Moves, predictions and decisions, checked."""
        task, decided = self.task, np.zeros(self.num_envs, bool)
        n = 2 + task.n_outputs
        if self._plain:
            given = np.clip(np.asarray(actions, dtype=float), -1.0, 1.0)
            wanted = (self.num_envs, n + self._decide)
            if given.shape != wanted or np.isnan(given).any():
                raise InvalidInput(
                    f"actions are numbers (environment, action) {wanted}, got"
                    f" {'NaN among them' if given.shape == wanted else given.shape}."
                )
            move = given[:, :2] * [task.max_speed, task.max_turn]
            return (
                move,
                self._span * given[:, 2:n],
                given[:, -1] > 0 if self._decide else decided,
            )
        keys = ("action", "prediction", "decide")[: 2 + self._decide]
        if not isinstance(actions, Mapping) or {*keys} - {*actions}:
            raise InvalidInput(
                f"an action has the keys {', '.join(keys)}, got {str(actions)[:80]}."
            )
        prediction = np.asarray(actions["prediction"], dtype=float)
        wanted = (self.num_envs, task.n_outputs)
        if prediction.shape != wanted or not np.isfinite(prediction).all():
            wrong = np.argwhere(~np.isfinite(prediction))
            lane = f" in lane {wrong[0][0]}" if prediction.shape == wanted else ""
            raise InvalidInput(
                f"a prediction is finite numbers {wanted}, got {prediction.shape}{lane}."
            )
        if self._decide:
            decided = np.asarray(actions["decide"]).reshape(self.num_envs).astype(bool)
        move = self.arena.check_action(np.asarray(actions["action"], dtype=float))
        return move, prediction, decided

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
        return tuple(draw_lane(self.arena, lane) for lane in range(self.num_envs))


class TouchEnv(gymnasium.Env):
    """One episode at a time; the same words as :class:`TouchVectorEnv`, without the lanes."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 15}  # noqa: RUF012

    def __init__(
        self, task: ActiveTask, *, render_mode: str | None = None, **form: Any
    ) -> None:
        self.lanes = TouchVectorEnv(task, 1, render_mode=render_mode, **form)
        self.task, self.render_mode = task, render_mode
        self.observation_space = self.lanes.single_observation_space
        self.action_space = self.lanes.single_action_space
        self.prediction_target_space = self.lanes.single_prediction_target_space
        self.loss_fn = task.compute_loss

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; ``options["touch"]`` says which touch it is."""
        super().reset(seed=seed)
        self.lanes._rngs = [self.np_random]
        observation, info = self.lanes.reset(options=options)
        return _first(observation), _first(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Go on by one action; errors as in :meth:`TouchVectorEnv.step`, and after the end."""
        if self.lanes._ended[0]:
            raise InvalidInput("the episode has ended; call reset().")
        if isinstance(action, Mapping):
            given: Any = {key: np.asarray(value)[None] for key, value in action.items()}
        else:
            given = np.asarray(action)[None]
        observation, reward, terminated, truncated, info = self.lanes.step(given)
        ends = bool(terminated[0]), bool(truncated[0])
        return _first(observation), float(reward[0]), *ends, _first(info)

    def render(self) -> np.ndarray | None:
        """A picture (height, width, 3)."""
        return (self.lanes.render() or (None,))[0]


def _first(values: Any) -> Any:
    """Lane 0 of everything."""
    if isinstance(values, Mapping):
        return {name: _first(value) for name, value in values.items()}
    return np.asarray(values)[0]


def _make_box(shape: tuple[int, ...]) -> Any:
    return spaces.Box(-np.inf, np.inf, shape, np.float64)


_FORM = ("decide", "render_mode", "plain", "repeat", "span", "workers")


def _make_task(name: str, fields: dict[str, Any]) -> tuple[ActiveTask, dict[str, Any]]:
    """The task of an environment's name, and how the environment is to be."""
    form = {"plain": True} | {key: fields.pop(key) for key in _FORM if key in fields}
    task = fields.pop("task", None)
    if task is None:
        return TASKS[name](**fields), form
    if fields:
        raise InvalidInput("give either task= or its fields, not both.")
    return task, form


def _make_env(name: str, **fields: Any) -> TouchEnv:
    """What ``gymnasium.make(name)`` calls; ``fields`` are the task's, or keywords of
    :class:`TouchVectorEnv`, of which ``plain`` is True by default.
    """
    task, form = _make_task(name, fields)
    return TouchEnv(task, **form)


def make_vector_env(name: str, num_envs: int = 1, **fields: Any) -> TouchVectorEnv:
    """What ``gymnasium.make_vec(name, num_envs)`` calls; ``fields`` as of :func:`_make_env`."""
    task, form = _make_task(name, fields)
    return TouchVectorEnv(task, num_envs, **form)


for name in TASKS:
    if name not in gymnasium.registry:
        gymnasium.register(
            name,
            entry_point="feeler.active.environment:_make_env",
            vector_entry_point="feeler.active.environment:make_vector_env",
            kwargs={"name": name},
        )
