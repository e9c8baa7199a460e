"""Constraints: what keeps a search from winning by ringing, floppiness or hinges that nobody can
make.
"""

from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.modes import compute_modes
from feeler.design.space import list_bending
from feeler.errors import InvalidInput
from feeler.records.record import Ge, Gt, Record

_Positive = Annotated[float, Gt(0)]


class Constraints(Record):
    """What a design must keep; all are off by default. In space stiffness is that of bending.

    Attributes
    ----------
    damping_ratio : Positive | None
        Least damping ratio of each of the first ``modes`` modes.
    damping_share : Positive | None
        Least damping ratio of each of them as a share of the reference's own.
    mass : Positive | None
        Greatest mass [mg].
    compliance : tuple[Positive, Positive] | None
        Least and greatest total compliance Σ 1/k as shares of the reference's.
    softest : Positive | None
        Least stiffness of a hinge as a share of the reference's softest.
    thickness : Positive | None
        Least diameter [mm] of a full round hinge of ``modulus`` that is as stiff: k = E π d⁴ / (64
        ℓ).
    modulus : Positive
        [MPa]; Kapton.
    peak_angle : Positive | None
        Greatest angle of a hinge in all touches [rad]; known only after they are simulated.
    """

    damping_ratio: _Positive | None = None
    damping_share: _Positive | None = None
    modes: Annotated[int, Ge(1)] = 6
    mass: _Positive | None = None
    compliance: tuple[_Positive, _Positive] | None = None
    softest: _Positive | None = None
    thickness: _Positive | None = None
    modulus: _Positive = 2500.0
    peak_angle: _Positive | None = None

    def _check(self) -> None:
        if self.compliance is not None and self.compliance[0] > self.compliance[1]:
            raise InvalidInput(
                f"compliance must be shares 0 < low ≤ high, got {self.compliance}."
            )

    def check(self, antenna: Antenna, reference: Antenna) -> dict[str, float]:
        """By constraint, how far it is broken, as the logarithm of the factor that is missing; 0:
        it holds.
        """
        found = {}
        if self.damping_ratio is not None or self.damping_share is not None:
            ratio = compute_modes(antenna, self.modes).damping_ratio
            if self.damping_ratio is not None:
                found["damping_ratio"] = _lack(ratio.min(), self.damping_ratio)
            if self.damping_share is not None:
                wanted = self.damping_share * compute_modes(reference, self.modes).damping_ratio
                found["damping_share"] = max(
                    _lack(a, b) for a, b in zip(ratio, wanted, strict=True)
                )
        if self.mass is not None:
            found["mass"] = _lack(self.mass, 1e3 * antenna.segment_mass.sum())
        if self.compliance is not None:
            own, other = (list_bending(one.stiffness) for one in (antenna, reference))
            share = np.sum(1 / own) / np.sum(1 / other)
            found["compliance"] = _lack(share, self.compliance[0]) + _lack(
                self.compliance[1], share
            )
        if self.softest is not None:
            own, other = (list_bending(one.stiffness) for one in (antenna, reference))
            found["softest"] = _lack(own.min(), self.softest * other.min())
        if self.thickness is not None:
            found["thickness"] = _lack(
                compute_diameter(antenna, self.modulus).min(), self.thickness
            )
        return found

    def check_peak(self, peak: float) -> float:
        """How far the peak angle is too great."""
        return 0.0 if self.peak_angle is None else _lack(self.peak_angle, peak)


def compute_diameter(antenna: Antenna, modulus: float) -> np.ndarray:
    """Diameter (segment,) [mm] of full round hinges of this modulus [MPa] that are as stiff: k = E
    π d⁴ / (64 ℓ). In space (plane, segment).
    """
    return (
        64 * list_bending(antenna.stiffness) * antenna.segment_length / (np.pi * modulus)
    ) ** 0.25


def _lack(value: float, least: float) -> float:
    return max(float(np.log(least / value)), 0.0) if value > 0 else np.inf
