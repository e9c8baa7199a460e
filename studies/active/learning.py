"""The learned policy: touches to practise on, and the training that made the stored weights.

``python -m studies.active.measure learn`` runs it as declared; to train a policy for other objects,
call ``train_policy`` on practices of your own task and ``save_policy`` the model. Needs PyTorch and
sb3-contrib: ``pip install sb3-contrib``.

Practice. To simulate every known touch under each body's own motion takes 10 ms of a core for one
decision, too much to learn from. Here a touch is simulated at each speed once, x_k(v, w) against
the way w gone ahead; a body that has gone w and moves at v feels x_k(v, w), as if v had been its
speed all the way. What a change of speed leaves behind, a few milliseconds, is therefore missing,
in what is felt and in what is known alike; all else is the observer's. It is for learning only:
policies are judged by :class:`feeler.active.Observer`.

Training. A body decides every 5 ms and is told :func:`feeler.active.policies.see`. Each decision
earns by how much the greatest belief has risen, so that an episode earns the belief in the verdict
at its deadline, less what guessing is worth.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import softmax

from feeler.active.observer import MENU, PERIOD, Belief, Policy
from feeler.active.policies import OWN, POLICY_KIND, POLICY_VERSION, make_actor, see
from feeler.active.tasks import SAMPLE, Arena, TouchTask
from feeler.errors import InvalidInput, MissingDependencyError
from feeler.tensors.formats import Model, save_model

ACTOR = (
    "lstm_actor.",
    "mlp_extractor.policy_net.",
    "action_net.",
)  # what moves the body; the critic is not kept

STEP, REACH = 0.1, 30.0  # [C] mm; places of the way, and how far: from there on nothing changes
SLOWEST = 0.06  # [C] mm/ms; whoever is slower feels as much


class Practice:
    """What all touches of a task feel like, in units of the noise, by speed and place of the
    way.
    """

    def __init__(self, task: TouchTask, *, menu: Sequence[float] = MENU) -> None:
        self.task, self.speeds = (
            task,
            np.array([speed for speed in sorted(menu) if speed >= SLOWEST]),
        )
        starts = [task.make_start(k) for k in range(task.pool)]
        self.label = np.array([start.target for start in starts], dtype=int)
        self.way = np.arange(0.0, REACH + STEP / 2, STEP)
        arena = Arena(task, len(starts))
        self.felt = np.zeros(
            (len(self.speeds), len(self.way), len(starts), len(arena.sensors)), np.float32
        )
        self.touched = np.zeros(self.felt.shape[:3], bool)
        for row, speed in enumerate(self.speeds):
            for lane, start in enumerate(starts):
                arena.begin(lane, np.random.default_rng(0), start)
            felt, touched = [arena.felt], [np.zeros(len(starts), bool)]
            for _ in range(int(np.ceil(REACH / speed / SAMPLE))):
                arena.step(np.tile([speed, 0.0], (len(starts), 1)))
                felt.append(arena.felt)
                touched.append(touched[-1] | arena.touching)
            sample = np.rint(self.way / speed / SAMPLE).astype(int)
            self.felt[row], self.touched[row] = (
                np.array(felt)[sample] / task.noise.size,
                np.array(touched)[sample],
            )


class Practised:
    """Bodies that feel each touch of a practice once and decide every 5 ms; what they know is a
    :class:`feeler.active.Belief`.
    """

    def __init__(self, practice: Practice, deadline: float, rng: np.random.Generator) -> None:
        self.practice, self.rng, self.deadline = practice, rng, deadline
        n = len(practice.label)
        self._evidence, self._touched = np.zeros((n, n)), np.zeros((n, n), bool)
        self.time, self._way, self._speed = 0.0, np.zeros(n), np.zeros(n)
        self.known = self._tell()

    def step(self, speed: np.ndarray) -> Belief:
        """Go on by a decision at speeds (body,) [mm/ms]."""
        practice, body = self.practice, np.arange(len(self._way))
        change = practice.task.acceleration * SAMPLE if self.time else np.inf
        for _ in range(round(PERIOD / SAMPLE)):
            self._speed = self._speed + np.clip(speed - self._speed, -change, change)
            self._way = self._way + SAMPLE * self._speed
            row = np.abs(self._speed[:, None] - practice.speeds).argmin(axis=1)
            place = np.minimum(np.rint(self._way / STEP).astype(int), len(practice.way) - 1)
            known = practice.felt[row, place]
            felt = known[body, body] + self.rng.standard_normal(
                (len(body), known.shape[2]), np.float32
            )
            self._evidence += np.einsum("bks,bs->bk", known, felt) - 0.5 * (known**2).sum(
                axis=2
            )
            self._touched |= practice.touched[row, place]
        self.time += PERIOD
        self.known = self._tell()
        return self.known

    def _tell(self) -> Belief:
        practice, weight = self.practice, softmax(self._evidence, axis=1)
        belief = weight @ np.eye(practice.task.n_outputs)[practice.label]
        touching = (weight * self._touched).sum(axis=1)
        return Belief(
            time=self.time,
            left=self.deadline - self.time,
            belief=belief,
            touching=touching,
            way=self._way,
            speed=self._speed,
            look=_look_no_further,
        )


def _look_no_further(speeds: Sequence[float], ms: float) -> np.ndarray:
    raise NotImplementedError("no look ahead in practice.")


def practise(
    practice: Practice, policy: Callable[[Belief], object], deadline: float, seed: int = 0
) -> float:
    """Share of right answers that bodies expect at the deadline [ms] who move by a policy."""
    bodies = Practised(practice, deadline, np.random.default_rng(seed))
    while bodies.known.left > 0:
        bodies.step(
            np.broadcast_to(np.asarray(policy(bodies.known), float), bodies.known.way.shape)
        )
    return float(bodies.known.belief.max(axis=1).mean())


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
                infos += [
                    {"terminal_observation": row} if known.left <= 0 else {} for row in last
                ]
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
    MissingDependencyError
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
        raise MissingDependencyError(
            "to learn a policy needs sb3-contrib: pip install sb3-contrib."
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
    return {
        name: value.detach().numpy() for name, value in state.items() if name.startswith(ACTOR)
    }


def make_trained(model: Any, deadline: float) -> Policy:
    """The policy of a trained model, without exploring."""
    return make_actor(read_actor(model), deadline)


def save_policy(model: Any, path: Path | str, settings: dict[str, Any]) -> None:
    """Write a trained policy's configuration and weights as safetensors."""
    save_model(
        Model(
            kind=POLICY_KIND,
            version=POLICY_VERSION,
            arrays=read_actor(model),
            settings=settings,
        ),
        path,
    )
