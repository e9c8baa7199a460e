"""Decoders answer labelled tensors with labelled arrays that hold the same numbers."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from feeler.analysis import compute_dispersion, compute_energy, compute_information
from feeler.decoding import (
    IdealObserver,
    PrincipalComponents,
    StreamDecoder,
    make_codes,
    make_labels,
    make_lda,
)
from feeler.decoding.classifiers import NO_CONTACT, count_until, make_svm
from feeler.decoding.curves import PeakEncoder
from feeler.decoding.network import TouchNetwork
from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.sweeps import compute_sweep
from feeler.decoding.transfer import TransferClassifier
from feeler.encoding import ConvolutiveNMF
from feeler.errors import InvalidInput
from feeler.tensors import in_unit

NETWORK = TouchNetwork((16, 40), max_epochs=2)
WITH_NAMES = [make_lda(3), make_svm(3), NETWORK]
CLASSIFIERS = [*WITH_NAMES, TransferClassifier(2, 0.01), StreamDecoder(window=10, max_lag=3)]
PARTS = ("feature", "location", "speed")


def name(estimator):
    return "-".join(
        type(step).__name__ for _, step in getattr(estimator, "steps", [("", estimator)])
    )


@pytest.fixture(scope="module")
def touches():
    """Twelve bumps that wander along sixteen sensors, four of each class, with the labels of
    touches.
    """
    rng, time = np.random.default_rng(0), np.arange(40.0)
    place = np.repeat([3.0, 8.0, 13.0], 4)
    bump = np.exp(-0.5 * (np.arange(16)[None, :, None] - place[:, None, None]) ** 2 / 4)
    values = bump * np.where(time > 12, 0.3, 0.0) + 1e-3 * rng.random((12, 16, 40))
    coords = {
        "feature": ("trial", np.repeat(["ball", "box", "wedge"], 4)),
        "location": ("trial", place / 16),
        "speed": ("trial", np.full(12, 0.3)),
        "sensor": np.arange(16),
        "time": ("time", time, {"units": "ms"}),
    }
    return xr.DataArray(values, dims=("trial", "sensor", "time"), coords=coords, name="angle")


@pytest.mark.further
@pytest.mark.parametrize("decoder", CLASSIFIERS, ids=name)
def test_answers_are_labelled_as_the_touches_are_and_the_same(decoder, touches):
    names = make_labels(touches, by=PARTS)
    parts = [touches[part].values.tolist() for part in PARTS]
    labels = names if decoder in WITH_NAMES else list(zip(*parts, strict=True))
    found = decoder.fit(touches.values, labels).predict(touches)
    assert found.dims == ("trial",) and found["feature"].values.tolist() == parts[0]
    assert found.values.tolist() == list(decoder.predict(touches.values)) == list(labels)
    assert decoder.score(touches, labels) == decoder.score(touches.values, labels) == 1
    if not hasattr(decoder, "predict_proba"):
        return
    chance = decoder.predict_proba(touches)
    assert chance.dims == ("trial", "class") and chance["class"].values.tolist() == sorted(
        {*names}
    )
    assert chance["speed"].values.tolist() == parts[2]
    np.testing.assert_array_equal(chance, decoder.predict_proba(touches.values))
    np.testing.assert_allclose(chance.sum("class"), 1, rtol=1e-5)


def test_what_did_not_touch_has_no_class(touches):
    labels = list(touches["feature"].values)
    for decoder in (TransferClassifier(2, 0.01), StreamDecoder(window=10, max_lag=3)):
        decoder.fit(touches.values, labels)
        still = touches.where(decoder.__class__ is StreamDecoder, np.nan) * 0
        assert decoder.predict(still[:1]).values.tolist() == [NO_CONTACT]
        assert np.isnan(decoder.predict_proba(still[:1])).all()


@pytest.mark.long
def test_codes_closest_matches_and_coordinates_are_labelled(touches):
    encoder = ConvolutiveNMF(
        n_components=2, n_lags=5, n_restarts=1, max_iter=5, random_state=0, warn=False
    )
    codes, plain = (make_codes(x, encoder) for x in (touches, touches.values))
    for kind, code in codes.items():
        assert code.dims == ("trial", "sensor" if kind == "raw" else "component", "time")
        assert code["location"].dims == ("trial",)
        np.testing.assert_array_equal(code, plain[kind])
    back = encoder.inverse_transform(codes["joint"])
    assert back.dims == touches.dims and back["time"].attrs["units"] == "ms"
    table = touches.stack(entry=("sensor", "time"))
    assert PrincipalComponents(2).fit_transform(table)["feature"].dims == ("trial",)
    assert PeakEncoder()(touches)["feature"].dims == ("trial",)


def test_a_groups_closest_matches_know_their_touches(touches):
    found, plain = (
        compute_dispersion(x, touches["feature"], indices=["pearson"])
        for x in (touches, touches.values)
    )
    value = found.values("pearson", "box")
    assert value["location"].values.tolist() == [8 / 16] * 4
    np.testing.assert_array_equal(value, plain.values("pearson", "box"))
    assert found.average == plain.average


def make_touches(seed=0):
    """Three classes of lumps with bending both ways, in noise (trial, sensor, time)."""
    rng = np.random.default_rng(seed)
    time, place = np.arange(20.0), np.arange(6.0)[:, None]
    lumps = [
        np.exp(-((place - 1.0 - k) ** 2) - ((time - 6.0 - k) / 3.0) ** 2)
        - 0.4 * np.exp(-((place - 3.0) ** 2) - ((time - 13.0) / 3.0) ** 2)
        for k in range(3)
    ]
    return np.repeat(lumps, 12, axis=0) + 0.3 * rng.normal(size=(36, 6, 20))


def test_a_peak_is_where_a_touch_bends_most_from_whichever_side():
    """Of labelled touches, one alone or among others."""
    touches = make_touches()[:4]
    sides = ["left", "right", "right", "left"]
    sign = np.array([1, -1, -1, 1])[:, None, None]
    given = xr.DataArray(
        sign * touches, {"side": ("trial", sides)}, ("trial", "sensor", "time")
    )
    np.testing.assert_array_equal(PeakEncoder(0)(given), PeakEncoder(0)(touches))
    np.testing.assert_array_equal(PeakEncoder(0)(given[:1]), PeakEncoder(0)(touches[:1]))


def test_dims_in_another_order_are_put_in_theirs_or_refused(touches):
    labels = list(touches["feature"].values)
    turned = touches.transpose("trial", "time", "sensor")
    for decoder in (make_lda(3), make_svm(3)):
        wanted = decoder.fit(touches, labels).predict_proba(touches)
        np.testing.assert_array_equal(decoder.predict_proba(turned), wanted)
        np.testing.assert_array_equal(
            decoder.fit(turned, labels).predict_proba(touches), wanted
        )
    assert compute_dispersion(turned).average == compute_dispersion(touches).average
    for refuse in (compute_energy, lambda X: compute_information(X, 0.1)):
        refuse(turned)
        with pytest.raises(InvalidInput, match=r"got \(time, sensor, trial\); transpose it"):
            refuse(touches.transpose("time", "sensor", "trial"))


def test_tensors_in_another_unit_than_those_that_were_learned_are_refused(touches):
    """In degrees all are 57 times as large; put back into radians they are answered as before."""
    labels = list(touches["feature"].values)
    turns = touches.assign_attrs(units="rad")
    degrees = np.rad2deg(turns).assign_attrs(units="deg")
    for decoder in (make_lda(3), IdealObserver(noise="common:0.01")):
        wanted = decoder.fit(turns, labels).predict_proba(turns)
        for ask in (decoder.predict, decoder.predict_proba):
            with pytest.raises(InvalidInput, match=r"learned tensors in rad, these are in deg"):
                ask(degrees)
        np.testing.assert_allclose(decoder.predict_proba(in_unit(degrees, "rad")), wanted)
        assert decoder.predict(touches.values).tolist() == labels  # an array says no unit


def test_other_sensors_clocks_and_masked_touches_are_not_answered_in_silence(touches):
    """Reversed sensors are refused, whatever classifies; times that differ are told of."""
    labels = list(touches["feature"].values)
    named = touches.assign_coords(sensor=range(touches.sizes["sensor"]))
    named = named.assign_coords(time=np.arange(float(touches.sizes["time"])))
    masked = np.ma.masked_greater(touches.values, float(touches.median()))
    fitted = (make_lda(3), IdealObserver(noise="common:0.01"), StudentTClassifier(3, step=2))
    for decoder in fitted:
        wanted = decoder.fit(named, labels).predict_proba(named)
        with pytest.raises(InvalidInput, match="or the same in another order"):
            decoder.predict(named[:, ::-1])
        for times, words in (
            (2 * named.time, "between samples"),
            (named.time - 5, "of the first sample"),
        ):
            with pytest.warns(UserWarning, match=f"another time {words}"):
                decoder.predict(named.assign_coords(time=times.values))
        for learn in (decoder.predict, lambda X, fit=decoder.fit: fit(X, labels)):
            with pytest.raises(InvalidInput, match="entries are masked"):
                learn(masked)
        turned = decoder.fit(named, labels).predict_proba(named.transpose("time", ...))
        np.testing.assert_array_equal(turned, wanted)
    with_numbers = named.assign_coords(trial=range(named.sizes["trial"]))
    right = xr.DataArray(labels, {"trial": with_numbers.trial}, "trial")
    for decoder in fitted:
        assert decoder.fit(with_numbers, right).score(with_numbers, right) == 1
        for wrong in (right[::-1], right.assign_coords(trial=right.trial + 1)):
            for ask in (decoder.fit, decoder.score):
                with pytest.raises(InvalidInput, match="labels are of other trials than the"):
                    ask(with_numbers, wrong)
            with pytest.raises(InvalidInput, match="in another order"):
                decoder.fit(with_numbers, pd.Series(labels)[::-1])
            with pytest.raises(InvalidInput, match="labels are of other trials than the"):
                compute_sweep(with_numbers, wrong, ratios=(0.1,), n_repeats=1, n_copies=2)
    lately = named.assign_coords(time=named.time * 2)
    assert count_until(lately, 6.0) == 4  # 0, 2, 4 and 6 ms
