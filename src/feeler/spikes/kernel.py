"""The compiled steps of sensilla: one sample of bending in, rates and spikes out.

Whole touches and streams take the same steps, so that both give the same numbers.
"""

import numpy as np

from feeler.compiled import compiled, lean

TABLE = ("tau", "a", "b", "c", "d", "v", "ceiling")
"""The rows of a table of parameters (parameter, unit)."""


@lean
def _adapt(excess, time, b):
    """e after ``time`` (in τ) of de/dt = −sign(e) |e|^b: exact, a power law for b > 1."""
    size = abs(excess)
    if size == 0.0:
        return 0.0
    if b == 1.0:
        return excess * np.exp(-time)
    return excess * (1.0 + (b - 1.0) * time * size ** (b - 1.0)) ** (-1.0 / (b - 1.0))


@lean
def step_units(sample, taps, shares, gains, table, step, excess, before, rate):
    """Move every unit on by one sample (sensor,); returns how stiff the stiffest one was.

    The stimulus runs straight from the sample before to this one: half of its change, the exact
    adaptation over the step, the other half (Strang's splitting, second order). The stiffness is
    the step over the time in which the threshold comes to follow such a slope.
    """
    stiffest = 0.0
    for k in range(rate.size):
        tau, a, b = table[0, k], table[1, k], table[2, k]
        near = taps[k]
        bend = sample[near] + shares[k] * (sample[near + 1] - sample[near])
        stimulus = max(0.0, gains[k] * bend)
        change = stimulus - before[k]
        before[k] = stimulus
        if change == 0.0 and excess[k] == 0.0:  # at rest, as one side always is
            rate[k] = min(max(table[3, k] * stimulus + table[4, k], 0.0), table[6, k])
            continue
        excess[k] = _adapt(excess[k] + 0.5 * change, step / tau, b) + 0.5 * change
        found = (
            a * excess[k] + table[3, k] * stimulus + table[4, k] + table[5, k] * change / step
        )
        rate[k] = min(max(found, 0.0), table[6, k])
        if a != 0.0 and change != 0.0:
            follows = (tau * abs(change) / step) ** ((b - 1.0) / b)
            stiffest = max(stiffest, step * b * follows / tau)
    return stiffest


@compiled
def encode_touch(samples, taps, shares, gains, table, step, rates):
    """Rates (time, unit) of one touch (time, sensor) that begins at rest; returns the stiffness."""
    units = rates.shape[1]
    excess, before, stiffest = np.zeros(units), np.zeros(units), 0.0
    for now in range(len(samples)):
        stiff = step_units(
            samples[now], taps, shares, gains, table, step, excess, before, rates[now]
        )
        stiffest = max(stiffest, stiff)
    return stiffest


@compiled
def start_firing(order, rng, left):
    """Draw for each unit how much of ∫ rate dt is left until its first spike, as if long begun."""
    for k in range(left.size):
        left[k] = 0.0
        for _ in range(1 + int(order * rng.random())):
            left[k] += rng.standard_exponential() / order


@compiled
def fire(rate, begin, step, order, refractory, spread, rng, left, ready, units, times, count):
    """Spikes of one sample that lasts from ``begin`` to ``begin + step`` [ms].

    They are put behind the ``count`` that the buffers hold already, which grow where they are too
    short; returned are both and the new count.
    """
    end = begin + step
    for k in range(rate.size):
        hazard = rate[k] * 1e-3
        now = max(begin, ready[k])
        while hazard > 0.0 and now < end:
            ahead = now + left[k] / hazard
            if ahead >= end:
                left[k] -= hazard * (end - now)
                break
            if count == times.size:
                units = np.append(units, np.zeros_like(units))
                times = np.append(times, np.zeros_like(times))
            units[count] = k
            times[count] = ahead + (spread * rng.standard_normal() if spread > 0.0 else 0.0)
            count += 1
            left[k] = 0.0
            for _ in range(order):
                left[k] += rng.standard_exponential() / order
            now = ready[k] = ahead + refractory
    return units, times, count


@compiled
def fire_touch(rates, begin, step, order, refractory, spread, rng):
    """Unit and time [ms] of every spike of one touch with these rates (time, unit)."""
    count, silent = 0, rates.shape[1]
    left, ready = np.zeros(silent), np.full(silent, -np.inf)
    units, times = np.zeros(64, dtype=np.int64), np.zeros(64)
    start_firing(order, rng, left)
    for now in range(len(rates)):
        units, times, count = fire(
            rates[now],
            begin + now * step,
            step,
            order,
            refractory,
            spread,
            rng,
            left,
            ready,
            units,
            times,
            count,
        )
    return units[:count], times[:count]
