"""Sampled antennas: one antenna in many variants, so that what learns from touch does not rely on
one (domain randomisation).
"""

from collections.abc import Sequence
from typing import Any, overload

import numpy as np

from feeler.antenna.animals import cockroach
from feeler.antenna.segments import Antenna
from feeler.draw import Drawn, LogRange, Spread, describe_spread, draw_shares, spread_out
from feeler.errors import InvalidInput
from feeler.validation import Seed, checked


@checked
class SampledAntennas(Sequence[Antenna]):
    """Variants of one antenna, each made when it is asked for; ``touch`` gives trial k number k
    modulo their number.

    Attributes
    ----------
    antenna
        What they are variants of.
    columns
        By name, what each is multiplied by: ``stiffness``, ``damping``, ``mass``; and ``gradient``,
        which is added to the logarithm of the stiffness along the antenna, −½ of it at the base and
        ½ at the tip. They become the coordinates ``antenna_stiffness`` … of the touches.
    recipe
        Plain data that make the same again.
    """

    def __init__(
        self, antenna: Antenna, columns: dict[str, np.ndarray], recipe: dict[str, Any]
    ) -> None:
        self.antenna, self.columns, self.recipe = antenna, columns, recipe

    def __len__(self) -> int:
        return len(self.columns["stiffness"])

    @overload
    def __getitem__(self, index: int) -> Antenna: ...
    @overload
    def __getitem__(self, index: slice) -> list[Antenna]: ...
    def __getitem__(self, index: int | slice) -> Antenna | list[Antenna]:
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        k = range(len(self))[index]
        stiffness, damping, mass, gradient = (
            float(self.columns[name][k])
            for name in ("stiffness", "damping", "mass", "gradient")
        )
        n = self.antenna.n_segments
        tilt = np.exp(gradient * ((np.arange(n) + 0.5) / n - 0.5))
        return self.antenna.replace(
            stiffness=self.antenna.stiffness * stiffness * tilt,
            damping=self.antenna.damping * damping,
            segment_mass=self.antenna.segment_mass * mass,
            name=f"{self.antenna.name} {k}",
        )

    def __repr__(self) -> str:
        return f"{len(self)} variants of {self.antenna!r}"


@checked
def sample_antennas(
    n: Drawn,
    antenna: Antenna | None = None,
    *,
    stiffness: Spread = LogRange(0.8, 1.25),
    damping: Spread = LogRange(0.8, 1.25),
    mass: Spread = LogRange(0.9, 1.1),
    gradient: Spread = (-0.5, 0.5),
    seed: Seed = 0,
) -> SampledAntennas:
    """Random variants of an antenna: as stiff, damped and heavy as ranges or distributions say;
    geometry stays.

    The k-th is the same however many are drawn. All defaults are choices [C].

    Parameters
    ----------
    antenna
        Default: the cockroach's.
    stiffness, damping, mass
        Factors, > 0: a number, a range (low, high), a list of choices, a ``LogRange`` or a frozen
        distribution of scipy.stats.
    gradient
        Added to the logarithm of the stiffness along the antenna: at the tip it is exp(gradient)
        times as stiff, relative to the base, as it was.

    Raises
    ------
    InvalidInput
        A range that leaves what an antenna may have.
    """
    antenna = antenna or cockroach()
    spreads = {"stiffness": stiffness, "damping": damping, "mass": mass, "gradient": gradient}
    columns = {
        name: spread_out(s, name, draw_shares(seed, f"antenna {name}", n))
        for name, s in spreads.items()
    }
    for name in ("stiffness", "damping", "mass"):
        if columns[name].min() <= 0:
            raise InvalidInput(
                f"{name} is a factor > 0, got {columns[name].min():.3g} from {spreads[name]!r}."
            )
    recipe = {name: describe_spread(spread) for name, spread in spreads.items()}
    return SampledAntennas(antenna, columns, {**recipe, "n": int(n), "seed": int(seed)})
