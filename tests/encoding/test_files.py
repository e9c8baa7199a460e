"""An encoder survives the disk; anything else says what it is."""

import json

import numpy as np
import pytest

from feeler.encoding import ConvolutiveNMF, load_encoder, save_encoder
from feeler.errors import StoreError


@pytest.fixture
def saved(touches, tmp_path):
    model = ConvolutiveNMF(2, 8, random_state=0, n_restarts=2, tol=1e-2).fit(touches)
    return model, save_encoder(model, tmp_path / "encoder.npz")


def test_round_trip(touches, saved):
    model, path = saved
    loaded = load_encoder(path)
    assert loaded.get_params() == model.get_params()
    assert (loaded.n_iter_, loaded.stability_, loaded.n_sensors_in_) == (model.n_iter_, model.stability_, 14)
    np.testing.assert_array_equal(loaded.transform(touches), model.transform(touches))
    assert [p.name for p in path.parent.iterdir()] == ["encoder.npz"]


def change_header(path, **changes):
    with np.load(path) as stored:
        arrays = dict(stored)
    header = json.loads(arrays.pop("header").tobytes()) | changes
    np.savez(path, header=np.frombuffer(json.dumps(header).encode(), dtype=np.uint8), **arrays)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 99}, "format version 99, this feeler reads version 1"),
        ({"format": "other"}, "something else"),
        ({"parameters": {"colour": "red"}}, "lacks parts"),
        ({"numbers": {"n_sensors_in_": 3}}, "should be"),
    ],
)
def test_a_file_that_does_not_fit_says_why(saved, changes, message):
    change_header(saved[1], **changes)
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
