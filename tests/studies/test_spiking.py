"""The study of spikes at a small size: what was declared is what is run, and it can fail."""

import numpy as np
import pytest

from feeler.antenna.animals import cockroach
from feeler.errors import InvalidInput
from studies.spikes.study import load_spiking

pytestmark = pytest.mark.long

ASKED = ("own", "shared", "100 spikes", "regular", "7 places", "null")


@pytest.fixture(scope="module")
def study():
    return load_spiking(
        variants=ASKED,
        each=8,
        sets=1,
        speeds=(0.6,),
        objects=("ball:radius=1.5", "box:half_width=3,half_height=3"),
        windows={"deadlines": [20, 50]},
    )


@pytest.fixture(scope="module")
def found(study):
    return study.run({"uniform": cockroach("uniform")}, workers=1).isel(
        antenna=0, set=0, speed=0
    )


def test_touches_are_told_apart_from_trains_and_not_where_there_is_nothing_to_tell(found):
    whole = found["accuracy"].sel(window="whole touch")
    told, null = whole.sel(level="own"), whole.sel(level="null")
    assert told.sel(classifier="ideal") > 0.9
    for code in ("counts", "first"):  # of ten, by classifiers with four lessons of each
        assert told.sel(classifier="ideal") >= told.sel(classifier=code) > 0.25
        assert null.sel(classifier=code) < 0.2


def test_the_ideal_observer_says_what_it_expects_and_not_how_often_it_was_right(found):
    """Eight trains of each of ten touches: hits would be in eightieths."""
    early = found["accuracy"].sel(classifier="ideal", level="own", window="20 ms").item()
    assert 0.1 < early < 1
    assert abs(80 * early - round(80 * early)) > 1e-6


def test_more_time_and_more_spikes_never_tell_an_ideal_observer_less(found):
    bits = found["bits"].sel(classifier="ideal")
    assert np.all(np.diff(bits.sel(level="own").values) > -0.1)
    assert bits.sel(level="100 spikes", window="whole touch") <= bits.sel(
        level="own", window="whole touch"
    )
    assert np.nanmax(bits) <= np.log2(10) + 1e-9


def test_variants_change_what_they_say(found):
    spikes = found["spikes"].sel(classifier="counts", window="whole touch")
    assert spikes.sel(level="100 spikes") == pytest.approx(100, rel=0.03)
    assert spikes.sel(level="7 places") < 0.2 * spikes.sel(level="own")
    assert spikes.sel(level="regular") < spikes.sel(level="own")  # it rests after each spike
    assert spikes.sel(level="shared") != spikes.sel(level="own")


def test_only_what_was_declared_is_asked(found):
    asked = np.isfinite(found["accuracy"])
    assert asked.sel(level="own").all() and asked.sel(level="shared").all()
    assert not asked.sel(level="regular", classifier="ideal").any()
    assert asked.sel(level="regular", classifier="counts").values.tolist() == [
        False,
        False,
        True,
    ]


def test_places_are_named_at_least_as_often_as_touches(found):
    """Of the ideal observer, who says what it expects, but for the chance of eighty hits."""
    for code in ("ideal", "counts", "first", "onset"):
        one = found.sel(classifier=code)
        touches, places = one["accuracy"].values, one["place"].values
        chance = 3 * np.sqrt(touches * (1 - touches) / 80) if code == "ideal" else 0.0
        known = np.isfinite(touches)
        assert np.all((places - touches + chance)[known] >= 0)


def test_what_was_not_declared_is_refused():
    with pytest.raises(InvalidInput, match="at least 4 touches of each class, got 1"):
        load_spiking(each=1)
    assert load_spiking(each=1, codes=("ideal",)).each == 1
    with pytest.raises(InvalidInput, match="unknown variant 'mine'; declared are own, shared"):
        load_spiking(variants=("mine",))
