"""Wall following as a closed loop: what the antenna passes on of a changing distance, and when
steering by it is stable.

For a body of speed v that turns at K_p e + K_d ė, delayed by τ, with K_p = ω²/v and K_d = 2ζω/v,
small errors obey ë(t) + 2ζω ė(t − τ) + ω² e(t − τ) = 0. With ζ = 1 that is stable for ωτ <
arctan(2r)/r, r² = 2 + √5, so ωτ < 0.647; what the antenna and the low-pass add to the delay makes
it less.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.errors import FeelerError, InvalidInput
from feeler.wall.approach import Posture, approach
from feeler.wall.distance import DistanceMap
from feeler.wall.following import (
    FOLLOWING,
    RUN_SUBSTEP,
    Controller,
    Course,
    _Runner,
    follow,
    make_course_scene,
)

ENGINE, TIMESTEP = (
    "chain-consistent",
    0.1,
)  # the full dynamics, at the coarsest step that the contact allows
OFFSET = 2.0  # [C] mm; how far from the target a run begins
QUIET = 1.0  # [C] mm; sd of the distance in the last third, up to which a run counts as stable
TURNS = 12.0  # [C] how many periods 1/ω a run lasts, at least 300 ms and at most 1500
CROSSING = float(np.sqrt(2 + np.sqrt(5)))
LIMIT = float(np.arctan(2 * CROSSING) / CROSSING)
"""Greatest ωτ of the loop without antenna, ζ = 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stability:
    """Which gains and delays are stable."""

    delay: np.ndarray
    """(delay,) [ms]"""
    frequency: np.ndarray
    """Natural angular frequency that the gains are set for (frequency,) [rad/ms]."""
    spread: np.ndarray
    """Sd of the distance in the last third of each run (delay, frequency) [mm]; NaN where the body
    ran into the wall, lost it, or its antenna has no map."""
    stable: np.ndarray
    """(delay, frequency)"""


def map_stability(
    antenna: Antenna,
    delays: Sequence[float],
    frequencies: Sequence[float],
    *,
    speed: float = 0.45,
    known: DistanceMap | None = None,
    oracle: bool = False,
    engine: str = ENGINE,
    timestep: float | None = TIMESTEP,
    target: float = 12.0,
) -> Stability:
    """Let a body that begins 2 mm off follow a straight wall with each gain and delay, and see
    whether it comes to rest.

    Parameters
    ----------
    known
        From :func:`feeler.wall.calibrate` at that speed and engine; an undefined one makes nothing
        stable.
    oracle
        Steer by the true distance: the loop without the antenna.
    """
    late, gains = np.asarray(delays, dtype=float), np.asarray(frequencies, dtype=float)
    if not late.size or not gains.size or late.min() < 0 or gains.min() <= 0 or not speed > 0:
        raise InvalidInput(
            "delays must be ≥ 0 ms, frequencies > 0 rad/ms and speed > 0 mm/ms, at least one of"
            " each."
        )
    if known is None and not oracle:
        raise InvalidInput("give known=calibrate(antenna, speed=…, engine=…), or oracle=True.")
    spread = np.full((late.size, gains.size), np.nan)
    if oracle or (known is not None and not known.undefined):
        for j, frequency in enumerate(gains):
            lasting = min(max(TURNS / frequency, 300.0), 1500.0)
            course = Course(lengths=(speed * lasting + 20.0,), turns=())
            for i, delay in enumerate(late):
                controller = Controller(target=target, frequency=frequency, delay=delay)
                try:
                    run = follow(
                        antenna,
                        course,
                        controller=controller,
                        speed=speed,
                        start=target + OFFSET,
                        distance_map=known,
                        oracle=oracle,
                        engine=engine,
                        timestep=timestep,
                    )
                except FeelerError:  # a body that loses itself in the wall
                    continue
                last = run.distance[2 * len(run.distance) // 3 :]
                if not run.collided and np.abs(last - target).max() < target:
                    spread[i, j] = last.std()
    with np.errstate(invalid="ignore"):
        return Stability(delay=late, frequency=gains, spread=spread, stable=spread <= QUIET)


def measure_wall_response(
    antenna: Antenna,
    known: DistanceMap,
    frequencies: Sequence[float] | np.ndarray,
    *,
    speed: float = 0.45,
    amplitude: float = 1.0,
    distance: float = 12.0,
    posture: Posture = FOLLOWING,
    engine: str = ENGINE,
    timestep: float | None = TIMESTEP,
    cycles: int = 4,
) -> np.ndarray:
    """Gain and phase of the antenna as a gauge of distance: complex ratio (frequency,) of the
    distance felt to the true one.

    The body weaves, so that its distance from a straight wall swings by ±``amplitude`` [mm] at each
    frequency [Hz]; both distances are fitted by a sine over the last ``cycles`` − 1 cycles. NaN
    where it was not in contact all the time.
    """
    if known.undefined:
        raise InvalidInput(f"the '{antenna.name}' antenna gives no map: {known.undefined}.")
    posture = posture.replace(side="right")
    rest = approach(antenna, posture, [distance], substep=RUN_SUBSTEP)
    found = []
    for hertz in np.asarray(frequencies, dtype=float):
        omega, course = 2e-3 * np.pi * hertz, Course(lengths=(1e4,), turns=())
        runner = _Runner(make_course_scene(rest, 0, course), speed, engine, timestep)
        heading, steps = omega * amplitude / speed, round(cycles * 1000 / hertz / runner.period)
        rows = []
        for k in range(steps):
            now, then = (heading * np.sin(omega * runner.period * t) for t in (k, k + 1))
            runner.go((then - now) / runner.period)
            rows.append((runner.time, -runner.body[0], float(known.predict(runner.feel()))))
        time, true, seen = np.array(rows).T
        found.append(
            _compare_swings(omega, *(x[steps // cycles :] for x in (time, true, seen)))
        )
    return np.array(found)


def _compare_swings(
    omega: float, time: np.ndarray, true: np.ndarray, seen: np.ndarray
) -> complex:
    if not np.isfinite(seen).all():
        return complex(np.nan, np.nan)
    basis = np.stack(
        [np.exp(1j * omega * time).real, np.exp(1j * omega * time).imag, np.ones_like(time)],
        axis=1,
    )
    (a, b, _), (c, d, _) = (
        np.linalg.lstsq(basis, values, rcond=None)[0] for values in (true, seen)
    )
    return complex(c, -d) / complex(a, -b)
