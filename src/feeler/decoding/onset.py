"""Noticing contact: the resting level of every sensor, and the moment one leaves it."""

import numpy as np

BASELINE = 300.0  # [C] samples over which the resting level is followed while nothing touches


class OnsetFinder:
    """Follows the resting level and notices when a sensor leaves it."""

    def __init__(self, onset: float, confirm: int, n_sensors: int) -> None:
        self.onset, self.confirm = onset, confirm
        self.level = np.full(n_sensors, np.nan)
        self.running, self.seen = 0, 0

    def see(self, sample: np.ndarray) -> bool:
        """Take one sample; whether contact is noticed with it."""
        known = np.isfinite(sample)
        fresh = known & np.isnan(self.level)
        self.level[fresh] = sample[fresh]
        away = sample - self.level
        beyond = np.abs(away[known]).max(initial=0.0) > self.onset
        self.running = self.running + 1 if beyond else 0
        if not beyond:
            self.seen += 1
            self.level[known] += away[known] / min(self.seen, BASELINE)
        return self.running >= self.confirm
