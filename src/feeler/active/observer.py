"""An ideal observer with a body: Bayes over known touches, all of them simulated under what the
body itself did.

K touches are known, equally likely. Under the same motion of the body they would be felt as x_k(t),
which is simulated; what is felt is y = x_j + s_j n, where s_k is what the task's noise gives for
x_k. After each period ln p(k|y) = −½ Σ ((y − x_k) / s_k)² − Σ ln s_k, up to a constant: exact for
any way to move, also one that depends on what was felt so far. A noise that isn't Gaussian is
replaced by a Gaussian one of its standard deviation. Bodies that have done the same share one
simulation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from scipy.special import softmax

from feeler.active.tasks import SAMPLE, Arena, TouchTask
from feeler.decoding.observers import compute_log_likelihood
from feeler.errors import InvalidInput
from feeler.records import Gt
from feeler.validation import Seed, checked

MENU = (0.0, 0.03, 0.06, 0.12, 0.3, 0.6, 1.2)  # [C] mm/ms
PERIOD = 5.0  # [C] ms between two decisions
_TOGETHER = 32  # [C] episodes whose prospects are weighed at a time
_DRAWS = 8  # [C] pairs of drawn noise of a look ahead
_LEAST = 1e-6  # rad; noise of which a sample has less is weighed, and drawn, as this
_Look = Callable[[Arena], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Belief:
    """Posterior of each agent; arrays (episode, …).

    Attributes
    ----------
    time : float
        Since the beginning [ms].
    left : float
        Until the deadline [ms].
    belief : np.ndarray
        Probability of each object (episode, object).
    touching : np.ndarray
        Probability that contact has begun (episode,).
    way : np.ndarray
        Gone ahead so far (episode,) [mm].
    speed : np.ndarray
        Now (episode,) [mm/ms].
    look : Callable[[Sequence[float], float], np.ndarray]
        ``look(speeds, ms)``: bits (episode, speed) about the object that a body expects to gain by
        each speed.
    """

    time: float
    left: float
    belief: np.ndarray
    touching: np.ndarray
    way: np.ndarray
    speed: np.ndarray
    look: Callable[[Sequence[float], float], np.ndarray] = field(repr=False)


Policy = Callable[[Belief], Any]
"""From what bodies know to their speeds (episode,) or one for all [mm/ms]; the nearest of the menu
is taken.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Episodes:
    """What bodies did and believed; row 0 is the beginning, then one row after each period.

    Attributes
    ----------
    time : np.ndarray
        (row,) [ms]
    target : np.ndarray
        Number of the object (episode,).
    belief : np.ndarray
        (row, episode, object)
    speed : np.ndarray
        Of the period that ends there (row, episode) [mm/ms]; in row 0 what the first one was.
    work : np.ndarray
        On the antenna since the beginning (row, episode) [µJ].
    """

    time: np.ndarray
    target: np.ndarray
    belief: np.ndarray
    speed: np.ndarray
    work: np.ndarray

    @property
    def accuracy(self) -> np.ndarray:
        """Share of right answers that the observer itself expects (row,): its mean greatest
        belief.
        """
        return self.belief.max(axis=2).mean(axis=1)

    @property
    def hits(self) -> np.ndarray:
        """Share of right answers (row,)."""
        return (self.belief.argmax(axis=2) == self.target).mean(axis=1)


# bodies that have done the same so far: what their arena kept, their episodes, and who touched
_Branch = tuple[Any, np.ndarray, np.ndarray]


@checked
class Observer:
    """All touches of a task, known, and what bodies that feel one of them make of it.

    Parameters
    ----------
    task
        Its ``pool`` of touches is what is known; its noise is what is felt.
    menu
        Speeds that a body may take [mm/ms].
    period
        Between two decisions [ms].
    random_state
        Of the noise; every policy meets the same.
    """

    def __init__(
        self,
        task: TouchTask,
        *,
        menu: Sequence[float] = MENU,
        period: Annotated[float, Gt(0)] = PERIOD,
        random_state: Seed = 0,
    ) -> None:
        if not isinstance(task, TouchTask) or task.noise.size <= 0:
            raise InvalidInput(
                "an observer needs a TouchTask with noise > 0; without noise everything is known at"
                " once."
            )
        if abs(period / SAMPLE - round(period / SAMPLE)) > 1e-9 or period < SAMPLE:
            raise InvalidInput(f"period must be whole milliseconds, got {period}.")
        self.task, self.period, self.seed = task, period, random_state
        self.menu = np.sort(np.asarray(menu, float))
        self.starts = [task.make_start(k) for k in range(len(task.trials))]
        self.label = np.array([start.target for start in self.starts], dtype=int)
        self._members = np.eye(task.n_outputs)[self.label]
        self._arena = Arena(task, len(self.starts))

    def run(
        self,
        policy: Policy,
        copies: int = 10,
        duration: float | None = None,
        *,
        touches: Sequence[int] | None = None,
        watch: tuple[int, _Look] | None = None,
    ) -> Episodes:
        """Let bodies feel each touch ``copies`` times, moving by a policy.

        Parameters
        ----------
        duration
            [ms]; default: the task's.
        touches
            Numbers of the touches that are felt; default: all.
        watch
            A touch, and what is called with the arena after each millisecond that the first body
            which feels it has moved; the touch is the lane.

        Raises
        ------
        InvalidInput
            A policy that gives no speeds.
        """
        k, duration = len(self.starts), self.task.duration if duration is None else duration
        if not self.period / 2 < duration < np.inf:
            raise InvalidInput(
                f"duration must be a look of {self.period:g} ms or more, got {duration:g} ms."
            )
        true = np.repeat(np.arange(k) if touches is None else touches, copies)
        rng = np.random.default_rng([self.seed, 1])
        for lane, start in enumerate(self.starts):
            self._arena.begin(lane, np.random.default_rng(0), start)
        evidence = np.zeros((true.size, k))
        speed, work, way = np.zeros((3, true.size))
        branches: list[_Branch] = [
            (self._arena.save(), np.arange(true.size), np.zeros(k, bool))
        ]
        rows = [(softmax(evidence, axis=1) @ self._members, speed, work)]
        for step in range(round(duration / self.period)):
            noise = rng.standard_normal((true.size, round(self.period), self._arena.n_felt))
            time = step * self.period
            known = self._tell(branches, evidence, way, speed, time, duration - time)
            speed = self._read(policy(known), true.size)
            parts = [
                (saved, own[speed[own] == v], met)
                for saved, own, met in branches
                for v in np.unique(speed[own])
            ]
            work, branches = work.copy(), []
            for saved, own, met_before in parts:
                is_watched = watch is not None and np.argmax(true == watch[0]) in own
                self._arena.load(saved)
                felt, touched = self._move(
                    speed[own[0]], self.period, watch[1] if watch and is_watched else None
                )
                branches.append((self._arena.save(), own, met_before | touched))
                sd = self._measure_noise(felt)
                met = felt[true[own]] + sd[true[own]] * noise[own]
                flat = (part.reshape(len(part), -1) for part in (met, felt, sd))
                evidence[own] += compute_log_likelihood(*flat)
                work[own] = self._arena.work[true[own]]
                way[own] = self._arena.base[0, 0]
            rows.append((softmax(evidence, axis=1) @ self._members, speed, work))
        belief, speeds, works = (np.array(column) for column in zip(*rows, strict=True))
        speeds[0] = speeds[min(1, len(speeds) - 1)]
        times = self.period * np.arange(len(rows))
        return Episodes(
            time=times, target=self.label[true], belief=belief, speed=speeds, work=works
        )

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

    def _tell(
        self,
        branches: Sequence[_Branch],
        evidence: np.ndarray,
        way: np.ndarray,
        speed: np.ndarray,
        time: float,
        left: float,
    ) -> Belief:
        weight = softmax(evidence, axis=1)
        touching = np.zeros(len(evidence))
        for _, own, touched in branches:
            touching[own] = weight[own] @ touched

        def look(speeds: Sequence[float], ms: float) -> np.ndarray:
            found = np.zeros((len(evidence), len(speeds)))
            for saved, own, _ in branches:
                for column, one in enumerate(speeds):
                    self._arena.load(saved)
                    felt, _ = self._move(float(one), ms)
                    sd = self._measure_noise(felt)
                    found[own, column] = expected_information_gain(
                        felt, weight[own], self.label, sd, self.seed
                    )
            return found

        return Belief(
            time=time,
            left=left,
            belief=weight @ self._members,
            touching=touching,
            way=way.copy(),
            speed=speed,
            look=look,
        )

    def _move(
        self, speed: float, ms: float, seen: _Look | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Go on; what each touch feels like (touch, sample, sensor), and whether it has begun."""
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

    def _measure_noise(self, felt: np.ndarray) -> np.ndarray:
        return np.maximum(self.task.measure_noise(felt), _LEAST)


def expected_information_gain(
    felt: np.ndarray,
    weight: np.ndarray,
    label: np.ndarray,
    sd: float | np.ndarray,
    seed: Seed = 0,
) -> np.ndarray:
    """Bits about the label that bodies expect of what may be felt next.

    Parameters
    ----------
    felt
        What each touch would feel like (touch, …) [rad].
    weight
        Beliefs of the bodies (episode, touch).
    label
        What each touch is (touch,).
    sd
        Standard deviation of the noise [rad], one or shaped like ``felt``.

    Returns
    -------
    numpy.ndarray
        Bits (episode,). The entropy that is left is a mean over the touches and over drawn noise,
        in pairs ±.
    """
    known = felt.reshape(len(felt), -1)
    spread = np.broadcast_to(sd, felt.shape).reshape(known.shape)
    half = np.random.default_rng(seed).standard_normal((_DRAWS, 1, known.shape[1]))
    drawn = known + spread * np.concatenate([half, -half])  # (draw, felt, entry)
    evidence = compute_log_likelihood(drawn, known, spread)  # (draw, felt, candidate)
    members = np.eye(label.max() + 1)[label]
    left = []
    for some in np.array_split(weight, -(-len(weight) // _TOGETHER)):
        with np.errstate(divide="ignore"):
            after = softmax(evidence + np.log(some)[:, None, None, :], axis=3) @ members
        left.append((some * _entropy(after).mean(axis=1)).sum(axis=1))
    return _entropy(weight @ members) - np.concatenate(left)


def _entropy(probability: np.ndarray) -> np.ndarray:
    """Of the last axis [bit]."""
    return -(probability * np.log2(np.maximum(probability, 1e-300))).sum(axis=-1)
