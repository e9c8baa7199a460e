"""Sensilla sample by sample: what robots and environments carry."""

from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.spikes.kernel import fire, start_firing, step_units
from feeler.spikes.population import STIFFEST, Population, refuse_coarse, refuse_gaps
from feeler.spikes.train import POISSON, Firing


class SensillaStream:
    """A population that is given one sample after the other; the numbers are those of the batch.

    Parameters
    ----------
    population
        Sensilla and where they sit.
    position
        (sensor,) of the sensors whose bending will be given, as shares of the antenna's length.
    step
        Time between samples [ms].
    firing
        How spikes follow from rates.
    seed, trial
        Make the generator, as in :func:`draw_spikes`.
    start
        Time of the first sample [ms].

    Attributes
    ----------
    rate : np.ndarray
        (unit,) after the last sample [Hz].
    time : float
        Of the next sample [ms].
    """

    @checked
    def __init__(
        self,
        population: Population,
        position: np.ndarray,
        step: float = 1.0,
        firing: Firing = POISSON,
        *,
        seed: Annotated[int, "≥ 0"] = 0,
        trial: int = 0,
        start: float = 0.0,
    ) -> None:
        if not step > 0:
            raise InvalidInput(f"step must be > 0 ms, got {step}.")
        self._taps, self._shares = population.find_taps(np.asarray(position, dtype=float))
        self._gains, self._table = population.side * population.gain, population.table
        self._population = population
        self._sensors, self._firing, self.step = len(position), firing, float(step)
        self._seed, self._start = (seed, trial), float(start)
        self.reset()

    def reset(self) -> None:
        """Begin again: at rest, with the first sample, and with the same draws."""
        units = self._taps.size
        self.rate, self.time = np.zeros(units), self._start
        self._excess, self._before = np.zeros(units), np.zeros(units)
        self._left, self._ready = np.zeros(units), np.full(units, -np.inf)
        self._units, self._times = np.zeros(64, dtype=np.int64), np.zeros(64)
        self._rng = np.random.default_rng([*self._seed])
        start_firing(self._firing.order, self._rng, self._left)

    def push(self, sample: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Take the bending of all sensors (sensor,), in space (plane, sensor), in the population's
        quantity.

        Returns
        -------
        unit, time
            Which units fired since the sample before, by number from 0, and when [ms]; latency and
            its spread are in it.

        Raises
        ------
        InvalidInput
            Other sensors, missing values, or a change too fast for the step.
        """
        values = np.ascontiguousarray(sample, dtype=float)
        planes = values.shape[:-1]
        if values.shape[-1:] != (self._sensors,) or planes not in ((), (2,), (3,)):
            raise InvalidInput(
                f"a sample has {self._sensors} sensors, got shape {values.shape}; in space it is"
                " (plane, sensor), of two planes or three."
            )
        refuse_gaps(values)
        values = self._population.bend_sides(values, planes != ())
        stiff = step_units(
            values,
            self._taps,
            self._shares,
            self._gains,
            self._table,
            self.step,
            self._excess,
            self._before,
            self.rate,
        )
        refuse_coarse(stiff, self.step, STIFFEST)
        firing = self._firing
        self._units, self._times, count = fire(
            self.rate,
            self.time - self.step + firing.latency,
            self.step,
            firing.order,
            firing.refractory,
            firing.spread,
            self._rng,
            self._left,
            self._ready,
            self._units,
            self._times,
            0,
        )
        self.time += self.step
        return self._units[:count].copy(), self._times[:count].copy()
