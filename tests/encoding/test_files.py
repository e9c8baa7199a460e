"""An encoder survives the disk; anything else says what it is."""

from dataclasses import replace

import numpy as np
import pytest

from feeler.encoding import ConvolutiveNMF, load_encoder, save_encoder
from feeler.errors import StoreError
from feeler.tensors.models import _read_model, save_model


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
