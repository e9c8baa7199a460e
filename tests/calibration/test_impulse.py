"""The impulse test: symmetric, causal, and the lever leaves the antenna."""

from types import SimpleNamespace

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.experiments.mechanics import IMPULSE_LEAD, hit

from .small_antenna import make_small


def take(dataset):
    return SimpleNamespace(**{name: item.values for name, item in dataset.variables.items()})


def test_nothing_moves_before_contact_and_the_tip_leads():
    result = take(hit(make_small(), points=(0.3, 0.71, 0.86), speed=0.3))
    before = result.time < -1e-9
    assert before.any() and np.abs(result.tip[before]).max() < 1e-12
    k = int(np.argmax(result.tip))
    assert (
        0
        < result.deflection[0, k]
        < result.deflection[1, k]
        < result.deflection[2, k]
        < result.tip[k]
    )
    assert np.abs(result.force[-1]).max() == 0.0


@pytest.mark.parametrize("lever", [None, 15.0])
def test_the_cylinder_goes_where_it_is_sent(lever):
    """At 0.4 mm/ms, straight ahead or, from contact on, round a lever's quarter circle and then
    along the antenna.
    """
    result = take(hit(make_small(), speed=0.4, lever=lever, sample_interval=0.5))
    speed = np.linalg.norm(np.diff(result.object, axis=0), axis=1) / 0.5
    np.testing.assert_allclose(speed, 0.4, rtol=2e-3)
    way = 0.4 * (result.time[-1] - result.time[0])
    ends = {
        None: (way, 0.0),
        15.0: (0.4 * IMPULSE_LEAD + 15.0, 0.4 * result.time[-1] - 15.0 * (np.pi / 2 - 1)),
    }
    (x, y), end = result.object[-1] - result.object[0], ends[lever]
    assert x == pytest.approx(end[0], rel=1e-3)
    assert y == pytest.approx(end[1], rel=2e-2, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"points": ()}, "points"),
        ({"points": (1.2,)}, "points"),
        ({"lever": -1.0}, "lever"),
        ({"speed": 0.0}, "speed"),
    ],
)
def test_impossible_hits_are_refused(options, match):
    with pytest.raises((InvalidInput, ZeroDivisionError), match=match):
        hit(make_small(), **options)
