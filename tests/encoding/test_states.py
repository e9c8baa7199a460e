"""What an encoder says of itself is true of its bases, in whatever order it was asked to learn."""

import copy
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from sklearn.base import clone

from feeler.encoding import (
    ConvolutiveNMF,
    compute_stability,
    load_encoder,
    locate_components,
    match_components,
    reconstruct,
    save_encoder,
)
from feeler.errors import InvalidInput, StoreError
from feeler.tensors.formats import _read_model, save_model
from paper.fig4 import prepare
from paper.scale import SCALES

TENSORS = np.random.default_rng(1).random((6, 5, 30)) ** 4


def make(**more):
    how = {"n_restarts": 2, "max_iter": 4, "random_state": 0, "warn": False, "n_jobs": 1}
    return ConvolutiveNMF(**{"n_components": 3, "n_lags": 5} | how | more)


def resize(model):
    """To and fro, so that a second time is another change."""
    n_lags = 5 if model.n_lags == 4 else 4
    return model.set_params(n_lags=n_lags, n_components=n_lags - 2)


OPERATIONS = {
    "fit": lambda model, _: model.fit(TENSORS),
    "partial_fit": lambda model, _: model.partial_fit(TENSORS[:2]),
    "fit_stream": lambda model, _: model.fit_stream(TENSORS, batch_size=4, n_epochs=2),
    "set_params": lambda model, _: model.set_params(sparseness=0.6, max_iter=3),
    "resize": lambda model, _: resize(model),
    "clone": lambda model, _: clone(model),
    "save, load": lambda model, folder: load_encoder(save_encoder(model, folder / "e.npz")),
    "pickle": lambda model, _: pickle.loads(pickle.dumps(model)),
}


def list_learned(model):
    return {key for key in vars(model) if key.endswith("_") and not key.startswith("_")}


def check(model):
    """Every learned attribute belongs to ``components_``, or is absent."""
    learned = list_learned(model)
    if not learned:
        return
    bases = model.components_
    np.testing.assert_allclose((bases**2).sum(axis=(1, 2)), 1, rtol=1e-9)
    assert (np.diff(locate_components(bases)) >= 0).all()
    assert model.n_sensors_in_ == bases.shape[1]
    assert model.transform(TENSORS).shape == (6, len(bases), 30)
    if learned == {"components_", "n_sensors_in_"}:
        return
    error = np.linalg.norm(TENSORS - reconstruct(bases, model.activations_))
    share = error / np.linalg.norm(TENSORS)
    assert model.reconstruction_err_ == pytest.approx(error)
    assert model.relative_residual_ == pytest.approx(share)
    assert model.restarts_[0] == pytest.approx(share)
    assert np.sqrt(2 * model.loss_curve_[-1]) == pytest.approx(error)
    assert model.n_iter_ == len(model.loss_curve_)
    np.testing.assert_array_equal(model.restart_components_[0], bases)
    for shift, found in ((True, model.stability_), (False, model.stability_in_place_)):
        expected = compute_stability(list(model.restart_components_), shift=shift)
        assert found == pytest.approx(expected)
    if "restart_activations_" in learned:  # too large to be saved
        np.testing.assert_array_equal(model.restart_activations_[0], model.activations_)


def apply(name, model, folder):
    """The encoder after an operation, or None where it was refused in words."""
    is_other_size = hasattr(model, "components_") and (
        (model.n_components, model.n_lags) != model.components_.shape[::2]
    )
    before = {key: getattr(model, key) for key in list_learned(model)}
    try:
        model = OPERATIONS[name](model, folder)
    except StoreError as error:
        assert "fit it before saving" in str(error)
        assert not before
        return None
    except InvalidInput as error:
        assert "Set them back to go on, or call fit or fit_stream" in str(error)
        assert (name, is_other_size) == ("partial_fit", True)
        assert all(getattr(model, key) is value for key, value in before.items())
        return None
    assert name != "partial_fit" or not is_other_size
    check(model)
    return model


@pytest.mark.parametrize("first", OPERATIONS)
def test_no_order_of_operations_leaves_anything_behind_that_is_not_true(first, tmp_path):
    """All pairs and triples: the third is asked of a copy of what the pair left."""
    begun = apply(first, make(), tmp_path)
    if begun is None:
        return
    for second in OPERATIONS:
        left = apply(second, copy.deepcopy(begun), tmp_path)
        for third in OPERATIONS if left is not None else ():
            apply(third, copy.deepcopy(left), tmp_path)


@pytest.mark.parametrize(
    "learn", [("fit",), ("fit_stream",), ("partial_fit", "partial_fit"), ("fit", "partial_fit")]
)
@pytest.mark.parametrize("kept", ["pickle", "save, load"])
def test_a_kept_encoder_goes_on_as_the_encoder_itself(learn, kept, tmp_path):
    model = make()
    for name in learn:
        OPERATIONS[name](model, tmp_path)
    other = OPERATIONS[kept](model, tmp_path)
    for one in (model, other):
        one.partial_fit(TENSORS[3:5])
    np.testing.assert_array_equal(other.components_, model.components_)


@pytest.mark.parametrize("learn", ["fit", "fit_stream"])
def test_a_small_batch_after_a_fit_does_not_throw_the_fit_away(planted, learn):
    tensors = planted[0]
    model = make(n_lags=8, max_iter=100, n_jobs=None)
    model.fit(tensors) if learn == "fit" else model.fit_stream(tensors, n_epochs=40)
    before, score = model.components_, model.score(tensors)
    model.partial_fit(tensors[:2])
    assert match_components(before, model.components_)[1].min() > 0.97
    assert model.score(tensors) > score - 0.03


def test_batches_that_are_forgotten_at_once_leave_the_bases_of_the_last():
    """The weight of what came before is the one asked for, after a fit as after batches."""
    model, other = make().fit(TENSORS), make().fit(TENSORS)
    apart = []
    for forget in (0.0, 1.0):
        one = copy.deepcopy(model).partial_fit(TENSORS[:1], forget=forget)
        apart.append(match_components(other.components_, one.components_)[1].mean())
    assert apart[0] < apart[1]


def test_silence_at_first_does_not_keep_a_stream_from_learning():
    quiet = np.concatenate([np.zeros((4, 5, 30)), TENSORS])
    model = make().fit_stream(quiet, batch_size=4, n_epochs=1)
    assert (model.components_.sum(axis=(1, 2)) > 0).all()
    after = make().fit(np.zeros_like(TENSORS)).partial_fit(TENSORS)
    assert after.score(TENSORS) > 0.1


def test_what_is_refused_leaves_the_encoder_as_it_was():
    model = make().fit(TENSORS)
    before = dict(vars(model))
    bad = np.concatenate([TENSORS, -TENSORS])
    for learn in (model.fit, model.partial_fit, model.fit_stream):
        with pytest.raises(InvalidInput, match="negative entries"):
            learn(bad)
    for wrong in ({"n_epochs": 0}, {"batch_size": 0}):
        with pytest.raises(InvalidInput, match=f"{next(iter(wrong))} must be a whole number"):
            model.fit_stream(TENSORS, **wrong)
    with pytest.raises(InvalidInput, match="holds no trials"):
        model.fit_stream(TENSORS[:0])
    with pytest.raises(InvalidInput, match=r"forget must lie between 0 and 1; got 1\.5"):
        model.partial_fit(TENSORS, forget=1.5)
    assert vars(model) == before


@pytest.mark.long
@pytest.mark.parametrize("learn", ["fit", "fit_stream", "partial_fit"])
@pytest.mark.parametrize("kept", ["pickle", "save, load"])
def test_however_it_learned_it_shows_itself_in_a_notebook(learn, kept, tmp_path):
    model = OPERATIONS[learn](make(), tmp_path)
    for one in (model, OPERATIONS[kept](model, tmp_path)):
        html = one._repr_html_()
        assert "data:image/png" in html
        assert ("relative_residual_" in html) == (learn == "fit")
        assert one._repr_mimebundle_()["text/html"] == html
    assert "n_components" in make()._repr_html_()


def test_masked_entries_are_refused_where_they_would_count():
    masked = np.ma.masked_greater(TENSORS, 0.9)
    count = int((TENSORS > 0.9).sum())
    model = make().fit(TENSORS)
    for take in (model.partial_fit, model.fit_stream):
        with pytest.raises(InvalidInput, match=f"{count} of 900 entries are masked|are masked"):
            take(masked)
    with pytest.raises(InvalidInput, match="entries are masked"):
        model.inverse_transform(np.ma.masked_greater(model.transform(TENSORS), 0.1))
    np.testing.assert_array_equal(  # nothing is masked: nothing is lost
        model.transform(np.ma.masked_array(TENSORS)), model.transform(TENSORS)
    )


@pytest.mark.parametrize("exponent", [-300, -160, -139, -30, 30, 139, 150, 200, 300])
@pytest.mark.parametrize("sparseness", [0.8, None])
def test_another_unit_gives_the_same_fit_or_a_word_on_it(exponent, sparseness):
    factor = 10.0**exponent
    model = make(sparseness=sparseness).fit(TENSORS)
    other = make(sparseness=sparseness)
    code = model.transform(factor * TENSORS)
    np.testing.assert_allclose(code, factor * model.transform(TENSORS), rtol=1e-9)
    assert model.score(factor * TENSORS) == pytest.approx(model.score(TENSORS), rel=1e-9)
    if abs(exponent) >= 140:
        for learn in (other.fit, other.partial_fit, other.fit_stream):
            with pytest.raises(
                InvalidInput, match=r"magnitude of the tensors is .*squares are"
            ):
                learn(factor * TENSORS)
        return
    other.fit(factor * TENSORS)
    np.testing.assert_allclose(other.components_, model.components_, rtol=1e-6, atol=1e-9)
    assert other.relative_residual_ == pytest.approx(model.relative_residual_, rel=1e-9)


@pytest.fixture
def saved(touches, tmp_path):
    model = ConvolutiveNMF(2, 8, random_state=0, n_restarts=2, tol=1e-2).fit(touches)
    return model, save_encoder(model, tmp_path / "encoder.safetensors")


def test_round_trip(touches, saved):
    model, path = saved
    loaded = load_encoder(path)
    assert loaded.get_params() == model.get_params()
    assert (loaded.n_iter_, loaded.stability_, loaded.n_sensors_in_) == (
        model.n_iter_,
        model.stability_,
        14,
    )
    np.testing.assert_array_equal(loaded.transform(touches), model.transform(touches))
    assert [p.name for p in path.parent.iterdir()] == ["encoder.safetensors"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"version": 99},
            "holds version 99 of 'ConvolutiveNMF'; this feeler reads 1. Update feeler",
        ),
        ({"kind": "Other"}, "holds a model of kind 'Other'"),
        ({"settings": {"parameters": {"colour": "red"}}}, "lacks parts"),
        ({"arrays": {"n_sensors_in_": np.array(3)}}, "should be"),
    ],
)
def test_a_file_that_does_not_fit_says_why(saved, changes, message):
    model = _read_model(saved[1], trusted=True)
    changes = {
        name: getattr(model, name) | value if isinstance(value, dict) else value
        for name, value in changes.items()
    }
    save_model(replace(model, **changes), saved[1])
    with pytest.raises(StoreError, match=message):
        load_encoder(saved[1])


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04broken"])
def test_other_files_are_refused(tmp_path, content):
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(StoreError, match="is not an encoder of feeler, or is damaged"):
        load_encoder(tmp_path / "x.npz")


def test_pickles_are_never_opened(tmp_path):
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(StoreError, match="is not an encoder"):
        load_encoder(tmp_path / "x.npy")


def test_missing_file_and_missing_fit(tmp_path):
    with pytest.raises(StoreError, match="There is no file"):
        load_encoder(tmp_path / "none.npz")
    with pytest.raises(StoreError, match="fit it before saving"):
        save_encoder(ConvolutiveNMF(), tmp_path / "x.npz")


PROGRAM = """
import sys
import numpy as np
import feeler.encoding
X = np.random.default_rng(0).random((4, 5, 30))
encoder = feeler.encoding.ConvolutiveNMF(2, 6, n_restarts=1, max_iter=2, warn=False).fit(X)
encoder.transform(X)
print(*sorted(sys.modules))
"""


@pytest.mark.long
def test_the_encoder_loads_no_physics_no_store_and_no_pictures():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.split())
    assert "feeler.encoding.factorise" in loaded
    banned = ("mujoco", "zarr", "h5py", "jinja2", "matplotlib", "feeler.physics")
    assert loaded.isdisjoint(banned)


def make_dataset(width=1.5, n_sensors=16, n_times=120):
    """Bumps at five locations, two features, two speeds; a little of it negative."""
    sensor, time = np.arange(n_sensors)[:, None], np.arange(n_times)[None, :]
    tensors, locations, features, speeds = [], [], [], []
    for location in (0.5, 0.6, 0.7, 0.8, 0.9):
        for feature, wide in (("ball", 1.0), ("box", 1.4)):
            for speed, lasting in ((0.6, 20), (0.06, 60)):
                phase = np.clip((time - 10) / lasting, 0, 1)
                bump = np.exp(
                    -0.5 * ((sensor - n_sensors * location - phase) / (width * wide)) ** 2
                )
                tensors.append(0.05 * bump * np.sin(np.pi * phase) - 1e-4)
                locations.append(location), features.append(feature), speeds.append(speed)
    coords = {
        "time": ("time", np.arange(n_times, dtype=float), {"units": "ms"}),
        "location": ("trial", locations),
        "feature": ("trial", features),
        "speed": ("trial", speeds),
        "size": ("trial", np.full(len(tensors), 1.5)),
    }
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), np.array(tensors))}, coords=coords
    )


@pytest.fixture(scope="module")
def touched():
    return make_dataset()


def test_what_is_encoded_is_rectified_and_named(touched):
    assert prepare(touched).min() == 0
    with pytest.raises(InvalidInput, match="quantity must be one of 'angle', 'curvature'"):
        prepare(touched, "torque")
    with pytest.raises(
        InvalidInput, match="unknown scale 'huge'; valid: smoke, quick, published, paper"
    ):
        SCALES["huge"]


def test_labels_of_sensors_times_and_masks_are_not_passed_over(tmp_path):
    """Bases are played on their own sensors in their order and at their time between samples."""
    labels = {"trial": np.arange(6), "sensor": list("vwxyz"), "time": 2.0 * np.arange(30)}
    labelled = xr.DataArray(TENSORS, dims=("trial", "sensor", "time"), coords=labels)
    streamed = make().fit_stream(labelled.transpose("time", ...), batch_size=4, n_epochs=1)
    plain = make().fit_stream(TENSORS, batch_size=4, n_epochs=1)
    np.testing.assert_array_equal(streamed.components_, plain.components_)
    for model in (make().fit(labelled), make().partial_fit(labelled), streamed):
        code = model.transform(labelled)
        for again in (model, load_encoder(save_encoder(model, tmp_path / "e.npz"))):
            np.testing.assert_array_equal(again.transform(TENSORS), code)
            for ask in (again.transform, again.score, copy.deepcopy(again).partial_fit):
                for names in ("zyxwv", "wxyza"):  # another order, the second sensor first
                    with pytest.raises(InvalidInput, match="or the same in another order"):
                        ask(labelled.assign_coords(sensor=list(names)))
                with pytest.warns(UserWarning, match="another time between samples"):
                    ask(labelled.assign_coords(time=np.arange(30)))
            with pytest.warns(UserWarning, match="have other names than those that were"):
                again.transform(labelled.assign_coords(sensor=list("abcde")))
            turned = again.inverse_transform(code.transpose("time", "component", "trial"))
            xr.testing.assert_identical(turned, again.inverse_transform(code))
    model = make().fit(labelled.assign_attrs(units="rad"))
    with pytest.raises(InvalidInput, match="learned tensors in rad, these are in deg"):
        model.transform(labelled.assign_attrs(units="deg"))
    for times, words in (
        ([*range(10), *range(13, 30)], "from 2 to 8"),
        (range(29, -1, -1), "from -2 to -2"),
    ):
        with pytest.raises(InvalidInput, match=f"not evenly spaced: steps in time {words}"):
            make().fit(labelled[:, :, [*times]])
    hidden = labelled > 0.9
    model = make().fit(labelled, mask=hidden.transpose("time", ...))
    np.testing.assert_array_equal(
        model.components_, make().fit(TENSORS, mask=hidden.values).components_
    )
    with pytest.raises(InvalidInput, match="other labels along trial than the tensors"):
        make().fit(labelled, mask=hidden[::-1])
    model.fit(labelled, mask=hidden[::-1].reindex_like(labelled))
