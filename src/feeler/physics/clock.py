"""The clock of a run: duration, samples and steps that fit each other."""

from dataclasses import dataclass

import numpy as np

from feeler.errors import InvalidInput

MAX_SAMPLES = 10_000_000
MAX_STEPS = 10_000_000_000  # [C] of one run or command: hours even of the smallest antenna


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Sample k is the state after k · ``steps_per_sample`` steps; sample 0 is the initial state.
    All in ms.
    """

    duration: float
    sample_interval: float = 1.0
    timestep: float

    def __post_init__(self) -> None:
        for name in ("duration", "sample_interval", "timestep"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"{name} must be finite and > 0 ms, got {value}.")
        count = np.ceil(self.duration / self.sample_interval - 1e-9) + 0.0
        if not 1 <= count <= MAX_SAMPLES:
            raise InvalidInput(
                f"duration {self.duration:g} ms at one sample per {self.sample_interval:g} ms gives"
                f" {count:.8g} samples; allowed are 1 to {MAX_SAMPLES}."
            )
        if self.duration / self.timestep > MAX_STEPS:
            raise InvalidInput(
                f"duration {self.duration:g} ms takes {self.duration / self.timestep:.3g} timesteps"
                f" of {self.timestep:g} ms; allowed are {MAX_STEPS:.0e}."
            )
        ratio = self.sample_interval / self.timestep
        if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio:
            raise InvalidInput(
                f"sample_interval must be a whole number of timesteps, got {self.sample_interval:g}"
                f" ms / {self.timestep:g} ms = {ratio:g}. Choose for example"
                f" timestep={self.sample_interval / max(1, round(ratio)):g}."
            )

    @property
    def n_samples(self) -> int:
        """Samples in [0, duration)."""
        return int(np.ceil(self.duration / self.sample_interval - 1e-9))

    @property
    def steps_per_sample(self) -> int:
        """Steps between samples."""
        return round(self.sample_interval / self.timestep)

    @property
    def time(self) -> np.ndarray:
        """Sample times (sample,) [ms], from 0."""
        return np.arange(self.n_samples) * self.sample_interval
