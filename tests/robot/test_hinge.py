"""The hinge model: flexure stiffness and its laws; the preset's geometry."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.robot import make_flexures, make_robot


def test_stiffness_of_a_worked_example():
    # E w t³ / (12 ℓ) = 2500 · 11 · 0.05³ / (12 · 0.5) = 0.572916… N·mm/rad
    stiffness = make_flexures(thickness=0.05, length=0.5).stiffness
    assert stiffness[0] == pytest.approx(0.5729166666666667, rel=1e-12)


@pytest.mark.parametrize(
    ("field", "power"), [("thickness", 3), ("modulus", 1), ("length", -1), ("width", 1)]
)
def test_stiffness_scales_with_each_measure(field, power):
    base = make_flexures()
    doubled = make_flexures(**{field: 2 * getattr(base, field)})
    np.testing.assert_allclose(doubled.stiffness / base.stiffness, 2.0**power)


def test_factors_scale_stiffness_and_damping():
    theory = make_flexures().stiffness
    robot = make_robot(stiffness_factor=1.19, damping_factor=2.06)
    np.testing.assert_allclose(robot.stiffness, 1.19 * theory)
    np.testing.assert_allclose(robot.damping, 2.06 * theory)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: make_flexures(thickness=0.0), "Flexures.thickness must be finite and > 0 mm"),
        (
            lambda: make_flexures(width=[1.0, -1.0]),
            "width must be .* > 0 mm, got -1.0 in hinge 2",
        ),
        (lambda: make_flexures(width=[1.0, 2.0], length=[1.0, 2.0, 3.0]), "all of one length"),
        (lambda: make_flexures(depth=1.0), "Flexures has no 'depth'; valid: width"),
        (lambda: make_robot(stiffness_factor=-1.0), "stiffness_factor must be > 0, got -1"),
        (lambda: make_robot(mass=float("nan")), "mass must be finite and > 0, got nan"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()
