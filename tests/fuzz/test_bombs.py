"""Small files that ask for much: an answer in time, bounded memory, one clear error; and a large
sound one is read.
"""

import struct
import zlib

import h5py
import numpy as np
import pytest
import scipy.io
import zarr

from feeler import Outline
from feeler.antenna.files import load_antenna
from feeler.errors import InvalidInput
from feeler.sandbox import Limits, open_guarded
from feeler.tensors.formats import load, save

from . import _hostile
from ._files import make_set

pytestmark = [pytest.mark.long, pytest.mark.guarded]

LIMITS = Limits(max_bytes=2**27, max_seconds=3)


def raise_if_invalid(path, words="", limits=LIMITS):
    with pytest.raises(InvalidInput, match=words):
        load(path, limits)


@pytest.mark.parametrize("dtype", ["str", "float64"])
def test_missing_chunks_by_the_million_are_refused(tmp_path, dtype):
    group = zarr.create_group(tmp_path / "x.zarr")
    group.create_array(
        "a", shape=(500_000_000,), chunks=(500,), dtype=str if dtype == "str" else dtype
    )
    raise_if_invalid(tmp_path / "x.zarr", "GiB|memory|took longer")


def test_text_that_unpacks_to_gigabytes_is_refused(tmp_path):
    group = zarr.create_group(tmp_path / "x.zarr")
    array = group.create_array("a", shape=(20,), chunks=(1,), dtype=str)
    array[:] = np.array(["a" * 2**25] * 20, dtype=object)
    raise_if_invalid(tmp_path / "x.zarr", "memory|MiB of text|damaged|took longer")


def test_one_long_key_does_not_hang(tmp_path, monkeypatch):
    monkeypatch.setenv("FEELER_MAX_SECONDS", "1")
    (tmp_path / "a.toml").write_text(".".join(["a"] * 200_000) + " = 1")
    with pytest.raises(InvalidInput, match=r"took longer than 1\.0"):
        load_antenna(tmp_path / "a.toml")


def test_a_description_that_is_no_text_is_none_and_the_arrays_say_what_they_are(tmp_path):
    tensors = make_set()
    save(tensors, tmp_path / "x.nc")
    with h5py.File(tmp_path / "x.nc", "a") as file:
        file.attrs["feeler_description"] = (
            file.attrs["feeler_description"].encode().replace(b"rad", b"\xff\xfe\xff", 1)
        )
        file.attrs["history"] = np.bytes_(b"\xff\xfe")
    found = load(tmp_path / "x.nc")
    assert found.equals(tensors) and found["angle"].attrs["units"] == "rad"


def add_narrow_variable(path, n):
    """One more variable in a MATLAB file: n doubles kept as bytes and compressed."""

    def element(kind, raw):
        return struct.pack("<II", kind, len(raw)) + raw + bytes(-len(raw) % 8)

    flags, dims = struct.pack("<II", 6, 0), struct.pack("<ii", n, 1)
    raw = zlib.compress(
        element(
            14,
            element(6, flags) + element(5, dims) + element(1, b"more") + element(2, bytes(n)),
        )
    )
    path.write_bytes(path.read_bytes() + struct.pack("<II", 15, len(raw)) + raw)


def test_compressed_numbers_stay_as_narrow_as_they_are_kept_and_are_counted_unpacked(tmp_path):
    for name, n in (("small.mat", 1000), ("x.mat", 200_000_000)):
        save(make_set(), tmp_path / name)
        add_narrow_variable(tmp_path / name, n)
    load(tmp_path / "small.mat", LIMITS)
    assert scipy.io.loadmat(tmp_path / "small.mat")["more"].dtype == np.uint8
    assert (tmp_path / "x.mat").stat().st_size < 2**20
    raise_if_invalid(tmp_path / "x.mat", "GiB|memory")


def test_texts_that_all_point_at_one_are_refused(tmp_path):
    n, size = 3000, 2**20
    with h5py.File(tmp_path / "x.nc", "w") as file:
        file["x"] = np.arange(n)
        file["x"].make_scale("x")  # dimensions make it netCDF
        texts = file.create_dataset("a", (n,), h5py.string_dtype())
        texts.dims[0].attach_scale(file["x"])
        texts[0] = "a" * size
        place = texts.id.get_offset()
    raw = bytearray((tmp_path / "x.nc").read_bytes())
    raw[place : place + 16 * n] = raw[place : place + 16] * n
    (tmp_path / "x.nc").write_bytes(raw)
    raise_if_invalid(tmp_path / "x.nc", "memory|MiB of text|took longer")


@pytest.mark.parametrize(
    ("function", "words"),
    [("crash", "broke down .code -11."), ("spin", "took longer than 1 s")],
)
def test_a_reader_that_crashes_or_hangs_is_contained(tmp_path, function, words):
    (tmp_path / "file").write_bytes(b"x")
    with pytest.raises(InvalidInput, match=f"file is damaged or hostile: its reader {words}"):
        open_guarded(
            f"{_hostile.__name__}:{function}", tmp_path / "file", Limits(max_seconds=1)
        )


CIRCLE = '<svg xmlns="http://www.w3.org/2000/svg" width="9mm"><circle r="{}"/></svg>'
CURVE = " C 900000 100000 2 -1000000 3 0"
DRAWN = '<svg xmlns="http://www.w3.org/2000/svg" width="10mm"><path d="M0 0{}Z"/></svg>'


@pytest.mark.parametrize(
    ("radius", "size"),
    [
        *((radius, {"width": 3.0}) for radius in ("1e300", "1e308")),
        *((radius, {"scale": 1.0}) for radius in ("1e300", "1e12", "1e308")),
    ],
)
def test_a_circle_too_large_to_draw_is_refused(tmp_path, radius, size, monkeypatch):
    monkeypatch.setenv("FEELER_MAX_GIB", "0.1")
    (tmp_path / "a.svg").write_text(CIRCLE.format(radius))
    with pytest.raises(
        InvalidInput, match=r"more than 1,000 corners|not finite|no shape|extent|cannot be read"
    ):
        Outline.from_file(tmp_path / "a.svg", **size)


@pytest.mark.parametrize(
    "inside",
    [
        CURVE * 500,
        pytest.param(" L1 1 2 2" * 800_000, marks=pytest.mark.long, id="lines"),
        pytest.param(CURVE * 250_000, marks=pytest.mark.long, id="curves"),
    ],
)
def test_a_drawing_that_asks_for_much_is_refused(tmp_path, inside, monkeypatch):
    monkeypatch.setenv("FEELER_MAX_SECONDS", "3")
    (tmp_path / "a.svg").write_text(DRAWN.format(inside))
    with pytest.raises(InvalidInput, match=r"more than 1,000 corners|took longer than 3"):
        Outline.from_file(tmp_path / "a.svg")
