"""Faults that fuzzing found, each kept as a case of its own."""

import io
from itertools import islice

import numpy as np
import pytest

from feeler import Outline
from feeler.decoding import StreamDecoder
from feeler.design.plan import TEMPLATE, load_plan
from feeler.errors import InvalidInput
from feeler.files import read_bytes
from feeler.robot.description import load_robot, write_robot
from feeler.robot.stream import _MAX_LINE, Link, read_lines, read_samples
from feeler.tables import parse_table
from feeler.tensors.formats import _read_model, load, save, save_model
from feeler.tensors.schema import find_errors
from feeler.tensors.store import _save_store, read_store
from feeler.tensors.writers import restore

from ._files import make_decoder, make_set


def test_a_high_limit_takes_no_memory(tmp_path):
    (tmp_path / "small").write_bytes(b"abc")
    assert read_bytes(tmp_path / "small", 2**60) == b"abc"


@pytest.mark.parametrize("number", ["1e31", "-1e308"])
def test_numbers_whose_products_overflow_are_refused(number):
    with pytest.raises(
        InvalidInput, match=r"line 2, column 'b': .* larger than anything measured"
    ):
        parse_table(f"a,b\n1,{number}\n")


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_shape_too_large_for_a_float_is_refused():
    content = {
        "variables": {"a": {"dims": ["x", "y"], "shape": [10**300, 10**300], "type": "<f8"}}
    }
    with pytest.raises(InvalidInput, match="has 1 values for the shape"):
        restore(content, {"a": np.zeros(1)}, "file")


@pytest.mark.parametrize("dims", [["x", "x"], [2, 8], "xy"])
def test_dims_are_names_each_given_once(dims):
    content = {"variables": {"a": {"dims": dims, "shape": [1, 1], "type": "<f8"}}}
    with pytest.raises(InvalidInput, match="dims are names, each given once"):
        restore(content, {"a": np.zeros((1, 1))}, "file")


@pytest.mark.parametrize("name", ["time", "position"])
def test_text_in_place_of_numbers_is_a_breach(name):
    dataset = make_set()
    texts = np.array([str(value) for value in dataset[name].values])
    breaches = find_errors(dataset.assign_coords({name: (dataset[name].dims, texts)}))
    assert breaches == [f"'{name}' has values that are not finite numbers"]


def test_a_store_passes_the_validator_before_its_numbers_are_read(tmp_path, monkeypatch):
    good = make_set()
    save(good, tmp_path / "good.zarr")
    _save_store(good.assign_coords(time=good.time.values[::-1]), tmp_path / "back.zarr")
    monkeypatch.setattr(
        "feeler.tensors.store._Numbers._read", lambda *_: pytest.fail("read a number")
    )
    assert load(tmp_path / "good.zarr").sizes == good.sizes
    with pytest.raises(InvalidInput, match="'time' must rise strictly"):
        load(tmp_path / "back.zarr")


def test_bytes_on_standard_input_that_are_no_text_are_counted():
    link = Link(3)
    sent = io.BytesIO(b"1,2,3\n1,\xff,3\n4,5,6\n")
    found = [values.tolist() for _, values in read_samples(read_lines(sent), 3, link)]
    assert found == [[1, 2, 3], [4, 5, 6]] and link.broken == 1
    assert "a sample must be numbers" in link.fault


def test_a_line_without_end_is_counted_before_it_is_read():
    class Endless(io.RawIOBase):
        def readable(self):
            return True

        def readinto(self, buffer):
            buffer[:] = b"1" * len(buffer)
            return len(buffer)

    link, pieces = Link(3), islice(read_lines(io.BufferedReader(Endless())), 5)
    assert list(read_samples(pieces, 3, link)) == [] and link.broken == 5
    assert f"a line of more than {_MAX_LINE} characters" in link.fault


def test_the_end_of_a_line_too_long_is_no_sample():
    lines = b"1,2,3\n" + 2 * _MAX_LINE * b"," + b"7,8,9\n" + b"4,5,6\n"
    link = Link(3)
    found = [
        values.tolist() for _, values in read_samples(read_lines(io.BytesIO(lines)), 3, link)
    ]
    assert found == [[1, 2, 3], [4, 5, 6]] and link.broken == 2


@pytest.mark.parametrize("depth", [400, 100_000])
def test_deep_nesting_in_a_store_is_damage(tmp_path, depth):
    save(make_set(), tmp_path / "set.zarr")
    path = tmp_path / "set.zarr" / "zarr.json"
    path.write_text(
        path.read_text().replace("{", '{"deep": ' + "[" * depth + "]" * depth + ",", 1)
    )
    with pytest.raises(InvalidInput, match=r"is damaged|not valid JSON"):
        read_store(tmp_path / "set.zarr")


def test_an_absurd_reading_in_a_stream_is_refused():
    with pytest.raises(InvalidInput, match="a sample is 3 finite numbers of at most 1e"):
        make_decoder().start().update(np.array([0.0, -1e308, 0.0]), 0.0)


@pytest.mark.parametrize("name", ["window", "confirm", "max_lag", "lag_step"])
def test_a_decoder_of_steps_beyond_all_indices_is_refused(tmp_path, name):
    path = tmp_path / "d.safetensors"
    make_decoder().save(path)
    file = _read_model(path)
    file.settings["parameters"][name] = 2**64
    save_model(file, path)
    with pytest.raises(InvalidInput, match="is no complete StreamDecoder"):
        StreamDecoder.load(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("location = 0.015", "location = [{}]"),
        ("location = 0.015", 'location = {logarithmic = ["a", 2]}'),
        ("size = 0.05", "size = {logarithmic = 3}"),
        ("friction = [0.6, 1.0]", "friction = []"),
    ],
)
def test_a_design_whose_choices_are_no_numbers_is_refused(tmp_path, old, new):
    assert old in TEMPLATE
    (tmp_path / "plan.toml").write_text(TEMPLATE.replace(old, new))
    with pytest.raises(
        InvalidInput, match=r"plan\.toml: .*(must be a (finite )?number|is needed)"
    ):
        load_plan(tmp_path / "plan.toml")


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_factor_that_makes_stiffness_overflow_is_refused(tmp_path):
    path = tmp_path / "robot.toml"
    write_robot(path, 3)
    text = path.read_text().replace("thickness = 0.05 ", "thickness = 50 ")
    path.write_text(text.replace("stiffness = 1.0", "stiffness = 1e308"))
    with pytest.raises(InvalidInput):
        load_robot(path)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_corners_beyond_a_kilometre_are_refused(tmp_path):
    (tmp_path / "c.csv").write_text("x,y\n1e20,0\n1e10,0\n0,1e20\n")
    with pytest.raises(InvalidInput, match=r"must lie within 1e\+06 mm, got 1e\+20"):
        Outline.from_file(tmp_path / "c.csv")
