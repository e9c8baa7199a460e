"""An ideal observer with a body: Bayes over known touches, all of them simulated under what the
body itself did.

K touches are known, equally likely. Under the same motion of the body they would be felt as x_k(t),
which is simulated; what is felt is y = x_j + σ n. After each period p(k|y) ∝ exp(−Σ (y − x_k)² /
2σ²), exact for any way to move, also one that depends on what was felt so far. Bodies that have
done the same share one simulation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from scipy.special import logsumexp, softmax

from feeler.active.arena import Arena
from feeler.active.task import SAMPLE, Start, TouchTask
from feeler.checked import checked
from feeler.errors import InvalidInput

MENU = (0.0, 0.03, 0.06, 0.12, 0.3, 0.6, 1.2)  # [C] mm/ms
PERIOD = 5.0  # [C] ms between two decisions
TOGETHER = 32  # [C] episodes whose prospects are weighed at a time
DRAWS = 8  # [C] pairs of drawn noise of a look ahead


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """What each body knows when it decides; arrays (episode, …)."""

    time: float
    """Since the beginning [ms]."""
    left: float
    """Until the deadline [ms]."""
    belief: np.ndarray
    """Probability of each object (episode, object)."""
    touching: np.ndarray
    """Probability that contact has begun (episode,)."""
    way: np.ndarray
    """Gone ahead so far (episode,) [mm]."""
    speed: np.ndarray
    """Now (episode,) [mm/ms]."""
    look: Callable[[Sequence[float], float], np.ndarray] = field(repr=False)
    """``look(speeds, ms)``: bits (episode, speed) about the object that a body expects to gain by
    each speed.
    """


Policy = Callable[[Known], Any]
"""From what bodies know to their speeds (episode,) or one for all [mm/ms]; the nearest of the menu
is taken.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Episodes:
    """What bodies did and believed; row 0 is the beginning, then one row after each period."""

    time: np.ndarray
    """(row,) [ms]"""
    target: np.ndarray
    """Number of the object (episode,)."""
    belief: np.ndarray
    """(row, episode, object)"""
    speed: np.ndarray
    """Of the period that ends there (row, episode) [mm/ms]; in row 0 what the first one was."""
    work: np.ndarray
    """On the antenna since the beginning (row, episode) [µJ]."""

    @property
    def accuracy(self) -> np.ndarray:
        """Share of right answers that the observer itself expects (row,): the mean of its greatest
        belief.
        """
        return self.belief.max(axis=2).mean(axis=1)

    @property
    def hits(self) -> np.ndarray:
        """Share of right answers (row,)."""
        return (self.belief.argmax(axis=2) == self.target).mean(axis=1)


@dataclass(eq=False)
class _Branch:
    """Bodies that have done the same so far."""

    saved: Any
    episodes: np.ndarray
    touched: np.ndarray


class Observer:
    """All touches of a task, known, and what bodies that feel one of them make of it.

    Parameters
    ----------
    task
        Its ``pool`` of touches is what is known; its noise is what is felt.
    menu
        Speeds that a body may take [mm/ms].
    """

    def __init__(
        self,
        task: TouchTask,
        *,
        menu: Sequence[float] = MENU,
        period: float = PERIOD,
        random_state: int = 0,
    ) -> None:
        if not isinstance(task, TouchTask) or task.noise <= 0:
            raise InvalidInput(
                "an observer needs a TouchTask with noise > 0; without noise everything is known at"
                " once."
            )
        if abs(period / SAMPLE - round(period / SAMPLE)) > 1e-9 or period < SAMPLE:
            raise InvalidInput(f"period must be whole milliseconds, got {period}.")
        self.task, self.menu, self.period, self.seed = (
            task,
            np.sort(np.asarray(menu, float)),
            period,
            random_state,
        )
        self.starts: list[Start] = [task.make_start(k) for k in range(len(task.trials))]
        self.label = np.array([start.target for start in self.starts], dtype=int)
        self._arena = Arena(task, len(self.starts))

    def run(
        self,
        policy: Policy,
        copies: int = 10,
        duration: float | None = None,
        *,
        touches: Sequence[int] | None = None,
        watch: tuple[int, Callable[[Arena], None]] | None = None,
    ) -> Episodes:
        """Let bodies feel each touch (or those of ``touches``) ``copies`` times, moving by a
        policy.

        Every policy meets the same noise. ``watch``: a touch, and what is called with the arena
        after each millisecond that the first body which feels it has moved; the touch is the lane.

        Raises
        ------
        InvalidInput
            A policy that gives no speeds.
        """
        k, duration = len(self.starts), duration or self.task.duration
        rng, true = (
            self.make_noise(),
            np.repeat(np.arange(k) if touches is None else touches, copies),
        )
        for lane, start in enumerate(self.starts):
            self._arena.begin(lane, np.random.default_rng(0), start)
        evidence, speed, work = np.zeros((true.size, k)), np.zeros(true.size), np.zeros(true.size)
        way = np.zeros(true.size)
        branches = [_Branch(self._arena.save(), np.arange(true.size), np.zeros(k, bool))]
        rows = [(self._believe(evidence), speed, work)]
        for step in range(round(duration / self.period)):
            noise = rng.standard_normal((true.size, round(self.period), len(self._arena.sensors)))
            known = self._tell(branches, evidence, way, speed, step * self.period, duration)
            speed = self._read(policy(known), true.size)
            branches = [part for branch in branches for part in self._split(branch, speed)]
            work = work.copy()
            for branch in branches:
                own = branch.episodes
                seen = (
                    watch[1] if watch is not None and np.argmax(true == watch[0]) in own else None
                )
                felt = self._go(branch, speed[own[0]], seen)
                evidence[own] += self._weigh(felt, true[own], noise[own])
                work[own] = self._arena.work[true[own]]
                way[own] = self._arena.reading.base[0, 0]
            rows.append((self._believe(evidence), speed, work))
        belief, speeds, works = (np.array(column) for column in zip(*rows, strict=True))
        speeds[0] = speeds[min(1, len(speeds) - 1)]
        time = self.period * np.arange(len(rows))
        return Episodes(time=time, target=self.label[true], belief=belief, speed=speeds, work=works)

    def make_noise(self) -> np.random.Generator:
        """What draws the noise of a run: standard normal numbers (episode, sample, sensor) for each
        period.
        """
        return np.random.default_rng([self.seed, 1])

    def _read(self, speeds: object, n: int) -> np.ndarray:
        """The nearest speeds of the menu (episode,)."""
        try:
            wanted = np.broadcast_to(np.asarray(speeds, dtype=float), (n,))
        except (TypeError, ValueError):
            wanted = np.full(n, np.nan)
        if not np.isfinite(wanted).all():
            raise InvalidInput(
                f"a policy gives one speed [mm/ms] for all bodies or one for each of the {n}, all"
                f" finite; got {str(speeds)[:60]}."
            )
        return self.menu[np.abs(wanted[:, None] - self.menu).argmin(axis=1)]

    def _tell(self, branches, evidence, way, speed, time: float, duration: float) -> Known:
        weight, touching = softmax(evidence, axis=1), np.zeros(len(evidence))
        for branch in branches:
            touching[branch.episodes] = weight[branch.episodes] @ branch.touched

        def look(speeds: Sequence[float], ms: float) -> np.ndarray:
            found = np.zeros((len(evidence), len(speeds)))
            for branch in branches:
                for column, one in enumerate(speeds):
                    self._arena.load(branch.saved)
                    felt = self._move(float(one), ms)[0]
                    own = weight[branch.episodes]
                    found[branch.episodes, column] = expect_gain(
                        felt, own, self.label, self.task.noise, self.seed
                    )
            return found

        belief = self._believe(evidence)
        return Known(
            time=time,
            left=duration - time,
            belief=belief,
            touching=touching,
            way=way.copy(),
            speed=speed,
            look=look,
        )

    def _believe(self, evidence: np.ndarray) -> np.ndarray:
        """Probability of each object (episode, object)."""
        weight = softmax(evidence, axis=1)
        return np.stack(
            [weight[:, self.label == c].sum(axis=1) for c in range(self.task.n_outputs)], axis=1
        )

    def _split(self, branch: _Branch, speed: np.ndarray) -> list[_Branch]:
        chosen = speed[branch.episodes]
        return [
            _Branch(branch.saved, branch.episodes[chosen == v], branch.touched)
            for v in np.unique(chosen)
        ]

    def _go(
        self, branch: _Branch, speed: float, seen: Callable[[Arena], None] | None
    ) -> np.ndarray:
        """Move a branch on by a period; what each touch would feel like (touch, sample, sensor)."""
        self._arena.load(branch.saved)
        felt, touched = self._move(speed, self.period, seen)
        branch.saved, branch.touched = self._arena.save(), branch.touched | touched
        return felt

    def _move(
        self, speed: float, ms: float, seen: Callable[[Arena], None] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        action, felt = np.tile([speed, 0.0], (len(self.starts), 1)), []
        touched = np.zeros(len(self.starts), bool)
        for _ in range(round(ms / SAMPLE)):
            self._arena.step(action)
            for error in self._arena.failed:
                if error is not None:
                    raise error
            felt.append(self._arena.felt)
            if seen is not None:
                seen(self._arena)
            touched |= self._arena.touching
        return np.stack(felt, axis=1), touched

    def _weigh(self, felt: np.ndarray, true: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Log-likelihoods (episode, touch), up to what all touches share."""
        flat, sd = felt.reshape(len(felt), -1) / self.task.noise, noise.reshape(len(true), -1)
        return (flat[true] + sd) @ flat.T - 0.5 * (flat**2).sum(axis=1)


def expect_gain(
    felt: np.ndarray, weight: np.ndarray, label: np.ndarray, noise: float, seed: int = 0
) -> np.ndarray:
    """Bits (episode,) about the label that bodies with beliefs ``weight`` (episode, touch) expect
    of what may be felt next.

    ``felt`` (touch, …) [rad] is what each touch would feel like, ``label`` (touch,) what it is. The
    entropy that is left is a mean over the touches and over drawn noise, which enters by its
    products with the touches alone, in pairs ±.
    """
    flat = felt.reshape(len(felt), -1) / noise
    flat = flat - flat.mean(axis=0)
    square = (flat**2).sum(axis=1)
    distance = np.maximum(square[:, None] + square - 2 * flat @ flat.T, 0.0)
    z = np.random.default_rng(seed).standard_normal((DRAWS, flat.shape[1])) @ flat.T
    drawn = np.concatenate([z, -z])
    ratio = drawn[:, None, :] - drawn[:, :, None] - distance / 2  # (draw, felt, candidate)
    members = np.eye(label.max() + 1)[label]
    left = []
    for some in np.array_split(weight, -(-len(weight) // TOGETHER)):
        with np.errstate(divide="ignore"):
            after = softmax(ratio + np.log(some)[:, None, None, :], axis=3) @ members
        left.append((some * _entropy(after).mean(axis=1)).sum(axis=1))
    return _entropy(weight @ members) - np.concatenate(left)


def _entropy(probability: np.ndarray) -> np.ndarray:
    """Of the last axis [bit]."""
    return -(probability * np.log2(np.maximum(probability, 1e-300))).sum(axis=-1)


@checked
def compute_posterior(
    felt: Annotated[np.ndarray, "sample ..."],
    known: Annotated[np.ndarray, "touch sample ..."],
    noise: float,
) -> np.ndarray:
    """Probability (sample + 1, touch) of each known touch after every sample of one that was felt,
    before the first included.

    Raises
    ------
    InvalidInput
        Shapes that do not go together, or noise that is not > 0.
    """
    felt, known = np.asarray(felt, dtype=float), np.asarray(known, dtype=float)
    if known.shape[1:] != felt.shape or not noise > 0:
        raise InvalidInput(
            f"felt {felt.shape} needs known touches of that shape and noise > 0, got {known.shape},"
            f" {noise}."
        )
    each = -0.5 * ((felt - known) ** 2).reshape(*known.shape[:2], -1).sum(axis=2) / noise**2
    evidence = np.concatenate([np.zeros((len(known), 1)), np.cumsum(each, axis=1)], axis=1).T
    return np.exp(evidence - logsumexp(evidence, axis=1, keepdims=True))
