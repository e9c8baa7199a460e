"""Units of antenna files against pint, which knows none of feeler's tables."""

import numpy as np
import pint
import pytest

from feeler.antenna.animals import fit_sigmoid
from feeler.antenna.files import BEAM_UNITS, FILE_UNITS
from feeler.errors import InvalidInput

PINT = pint.UnitRegistry()
EVERY = [(name, unit) for name, units in (FILE_UNITS | BEAM_UNITS).items() for unit in units]


def read(unit):
    return PINT.parse_units(unit.replace("·", "*").replace("³", "**3"))


@pytest.mark.parametrize(("name", "unit"), EVERY)
def test_every_factor_is_pints(name, unit):
    units = (FILE_UNITS | BEAM_UNITS)[name]
    assert PINT.Quantity(1.0, read(unit)).to(
        read(next(iter(units)))
    ).magnitude == pytest.approx(units[unit], rel=1e-12)


def test_a_stiffness_is_a_modulus_times_an_area_times_a_length():
    """Of a beam, E I / l: MPa · mm⁴ / mm is the N·mm that a hinge has per radian."""
    own = {name: read(next(iter(units))) for name, units in BEAM_UNITS.items()}
    made = PINT.Quantity(1.0, own["modulus"] * own["radius"] ** 4 / own["length"] / PINT.rad)
    assert made.to(read(next(iter(FILE_UNITS["stiffness"])))).magnitude == pytest.approx(1.0)
    weight = PINT.Quantity(
        1.0, own["density"] * own["width"] * own["thickness"] * own["length"]
    )
    assert weight.to(read(next(iter(FILE_UNITS["segment_mass"])))).magnitude == pytest.approx(
        1.0
    )
    slow = PINT.Quantity(1.0, own["damping_time"] * read(next(iter(FILE_UNITS["stiffness"]))))
    assert slow.to(read(next(iter(FILE_UNITS["damping"])))).magnitude == pytest.approx(1.0)


@pytest.mark.parametrize("value", [np.inf, -1.0, 0.0])
def test_one_length_that_cannot_be_is_enough_to_refuse_an_antenna(value):
    with pytest.raises(
        InvalidInput, match="antenna 1 has segment lengths that are not finite and > 0"
    ):
        fit_sigmoid([np.where(np.arange(20) == 3, value, 1.0)])
