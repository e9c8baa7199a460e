"""The lines that a board sends: numbered, timed and summed, so that every fault is noticed.

    $12,1034.250,4.73,4.71,nan*7F

After the dollar: a number that rises by one and wraps at 65536, the board's time [ms], one value
per sensor; after the asterisk the exclusive or of all bytes between the two, as two hexadecimal
digits (as NMEA 0183 has it).
"""

from functools import reduce
from operator import xor

import numpy as np

WRAP = 65536
CLOCK = (
    2**32 / 1000
)  # ms after which a board's clock of microseconds in 32 bits begins anew (71.6 minutes)
_MAX_HOLE = 2000  # [C] samples in a row; a longer hole is a board that began anew


def frame_sample(number: int, time: float, values: np.ndarray) -> str:
    """One sample as a board sends it, without the end of the line."""
    body = f"{number % WRAP},{time:.3f}," + ",".join(f"{value:.6g}" for value in values)
    return f"${body}*{_sum(body):02X}"


def unwrap_clock(time: np.ndarray) -> np.ndarray:
    """Times (sample,) [ms] that go on where a board's clock began anew.

    Times that fall by less than half of its range stay.
    """
    return time + CLOCK * np.cumsum(np.diff(time, prepend=time[:1]) < -CLOCK / 2)


class Link:
    """Takes lines as they come and gives samples in order; what was lost becomes samples of NaN.

    Attributes
    ----------
    lost, late, broken : how many samples never came, came again or too late, and did not add up.
    """

    def __init__(self, n_sensors: int) -> None:
        self.lost = self.late = self.broken = 0
        self._n, self._last, self._time, self._turns = n_sensors, -1, 0.0, 0

    def take(self, line: str) -> list[tuple[float, np.ndarray]]:
        """Samples (time [ms], values) that a line adds: none, one, or one and those lost before."""
        number, time, values = self._read(line.strip())
        if number is None:
            self.broken += 1
            return []
        ahead = 1 if self._last < 0 else (number - self._last) % WRAP
        if ahead == 0 or ahead > WRAP - _MAX_HOLE:
            self.late += 1
            return []
        if ahead > _MAX_HOLE:  # a board that began anew, and its clock with it
            self._turns, self._time = 0, time
        before, missing, time = (
            self._time,
            (ahead - 1 if ahead <= _MAX_HOLE else 0),
            self.follow(time),
        )
        step = (time - before) / (missing + 1)
        holes = [(before + k * step, np.full(self._n, np.nan)) for k in range(1, missing + 1)]
        self.lost += missing
        self._last = number
        return [*holes, (time, values)]

    def follow(self, time: float) -> float:
        """The board's time [ms], going on where its clock began anew."""
        self._turns += time + self._turns * CLOCK < self._time - CLOCK / 2
        self._time = time + self._turns * CLOCK
        return self._time

    def describe(self) -> str:
        """What was wrong, in words; empty where nothing was."""
        parts = [(self.lost, "lost"), (self.late, "late or doubled"), (self.broken, "broken")]
        return ", ".join(f"{count} {word}" for count, word in parts if count)

    def _read(self, line: str) -> tuple[int | None, float, np.ndarray]:
        bad = None, 0.0, np.empty(0)
        body, star, digits = line[1:].partition("*")
        cells = body.split(",")
        try:
            if not star or int(digits, 16) != _sum(body) or len(cells) != self._n + 2:
                return bad
            number, time, values = (
                int(cells[0]),
                float(cells[1]),
                np.array([float(cell) for cell in cells[2:]]),
            )
        except ValueError:
            return bad
        return (number, time, values) if 0 <= number < WRAP and np.isfinite(time) else bad


def _sum(body: str) -> int:
    return reduce(xor, body.encode("utf-8", errors="replace"), 0)
