"""Slopes: of the score, against central differences; and down them a search of many knots goes."""

import numpy as np
import pytest

from feeler.design import Constraints, Space, optimise, score
from feeler.design.scoring import decode, scale
from feeler.design.slope import differentiate_bits, differentiate_score, unscale
from tests.design.test_design import ANTENNA, TASK


def differ(function, x, direction, step):
    return (function(x + step * direction) - function(x - step * direction)) / (2 * step)


@pytest.mark.parametrize("sd", [0.5, 2.0])
def test_the_slope_of_the_bits_is_that_of_their_differences(sd):
    rng = np.random.default_rng(0)
    tensors, direction = rng.standard_normal((2, 3, 5, 12))
    bits, slope = differentiate_bits(tensors, 3, sd)
    assert bits == pytest.approx(decode(tensors, 3, sd)[0].mean())
    known = differ(lambda x: decode(x, 3, sd)[0].mean(), tensors, direction, 1e-5)
    assert np.sum(slope * direction) == pytest.approx(known, rel=1e-6)


def test_dividing_by_peaks_has_its_slope_too():
    rng = np.random.default_rng(1)
    angles, direction, weights = rng.standard_normal((3, 2, 3, 4, 5))
    known = differ(
        lambda x: np.sum(scale(x, "relative") * weights.reshape(2, 3, -1)), angles, direction, 1e-6
    )
    assert np.sum(unscale(weights, angles) * direction) == pytest.approx(known, rel=1e-6)


@pytest.mark.parametrize("noise", ["relative", "common"])
def test_the_slope_of_the_score_is_that_of_its_differences(noise):
    task = TASK.replace(noise=noise, level={"relative": 0.5, "common": 0.2}[noise])
    bits, peak, slopes = differentiate_score(ANTENNA, task, workers=1)
    whole = score(ANTENNA, task, "optimiser", workers=1)
    assert (bits, peak) == pytest.approx((whole.bits, whole.peak))
    direction = np.array([1.0, -1.0, 0.5, 2.0, -0.5, 1.0])
    for name in ("stiffness", "damping", "segment_mass"):
        own = getattr(ANTENNA, name)

        def bits_at(t, name=name, own=own):
            return score(
                ANTENNA.replace(**{name: own * np.exp(t * direction)}), task, "optimiser", workers=1
            ).bits

        known = (bits_at(1e-5) - bits_at(-1e-5)) / 2e-5
        slope = slopes[name] * own
        assert np.sum(slope * direction) == pytest.approx(known, abs=1e-3 * np.linalg.norm(slope))


def test_down_the_slope_a_free_antenna_gets_better_and_keeps_its_constraints():
    space = Space(reference=ANTENNA, stiffness=6, damping=6, span=10.0)
    limits = Constraints(damping_share=1.0)
    found = optimise(TASK, space, limits, method="lbfgs", evaluations=36, workers=1)[0]
    assert found.best.bits > score(ANTENNA, TASK, "optimiser").bits + 0.01
    assert limits.check(found.design.antenna, ANTENNA) == {"damping_share": 0.0}
