"""Every reader against damaged and hostile input: no crash, no hang, no traceback, only feeler's own errors.

Each Hypothesis example is a seed from which 100 inputs are made; a failure shrinks to one seed and prints its input.
"""

import os
import shutil
import tempfile
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import feeler
from feeler.antenna.cockroach import cockroach
from feeler.antenna.file import load_antenna, save_antenna
from feeler.calibration.targets import load_targets
from feeler.decoding.stream import parse_sample
from feeler.encoding import ConvolutiveNMF, load_encoder, save_encoder
from feeler.errors import FeelerError
from feeler.robot.recording import load_recording
from feeler.robot.sensor import load_calibration, load_calibration_table
from feeler.tensors.export import save
from feeler.tensors.hdf5 import build_dataset
from feeler.tensors.hdf5_child import read_file
from feeler.tensors.limits import Limits
from feeler.tensors.load import load, load_zarr
from feeler.tensors.mat import load_mat
from feeler.tensors.model import Model, read_model, save_model
from feeler.tensors.store import open_store, read_store
from feeler.tensors.table import load_csv
from feeler.tensors.validate import find_breaches
from feeler.tracking.tracks import load_tracks

from ._mutate import mutate, survives

PER_EXAMPLE = 100
LIMITS = Limits(max_bytes=2**22, max_text=2**20, max_chunks=1000)
MEMORY = Path("/dev/shm") if os.access("/dev/shm", os.W_OK) else Path(tempfile.gettempdir())
QUICK = settings(max_examples=3, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
LONG = settings(max_examples=1000, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def make_tensors(n_trials=2):
    """A small valid set."""
    from feeler.tensors import make_tensors

    rng = np.random.default_rng(1)
    labels = {"feature": ["ball", "wall"], "size": [1.5, np.inf], "location": [0.5, 0.7], "speed": [0.3, 0.06]}
    labels |= {"antenna": ["small"] * 2, "source": ["simulation"] * 2, "seed": [1, 2]}
    return make_tensors(
        angle=rng.normal(size=(n_trials, 3, 8)),
        time=np.arange(8.0),
        segment=[1, 2, 3],
        position=np.array([0.0, 0.3, 0.6]),
        segment_length=np.ones(3),
        trials={name: values[:n_trials] for name, values in labels.items()},
        tip=rng.normal(size=(n_trials, 8, 2)),
        attrs={"configuration": {"a": 1}, "versions": {}, "licence": "CC0-1.0"},
    )


RECORDING = b"""# robot: one
# source: robot
# feature: ball
# size: 1.5 mm
time_ms,hinge1_deg,hinge2_deg,hinge3_deg
0,0.1,0.2,-0.3
1.0,0.5,,1e-3
2,0.1,nan,0.3
"""
DLTDV = b"pt1_cam1_X,pt1_cam1_Y,pt2_cam1_X,pt2_cam1_Y\n1.5,2.5,NaN,NaN\n2.5,3.5,4.5,5.5\n3,4,5,6\n"
NAMED = b"left_tip_x;left_tip_y;head_x;head_y\n1.5;2.5;3;4\n2.5;3.5;4.5;5.5\n"
TABLE = b"# robot: one\nhinge,angle_deg,capacitance_pF,time_ms\n1,0,1.0,0\n1,5,1.2,1\n1,9,1.5,2\n"
TABLE += b"2,0,1,3\n2,5,1.2,4\n2,9,1.4,5\n"
TARGETS = b'name = "x"\nstatus = "measured"\n[targets.frequency]\nvalue = 1.0\nspread = 0.1\nunit = "Hz"\ntag = "D"\n'
SAMPLES = [b"0.5,1.0,2.0,3.0", b"1 2 3", b"nan;1e-3;\t4"]


def in_file(read):
    """A reader of bytes from a reader of paths."""

    def reader(data: bytes, folder: Path) -> None:
        path = folder / "input"
        path.write_bytes(data)
        read(path)

    return reader


def file_seeds(*names):
    """Seeds from files that feeler writes."""

    def make() -> list[bytes]:
        with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
            paths = [Path(folder, name) for name in names]
            for path in paths:
                _write(path)
            return [path.read_bytes() for path in paths]

    return make


def _write(path: Path) -> None:
    if path.suffix == ".toml":
        antenna = cockroach().replace(sensors=[1, 5])
        save_antenna(antenna if "long" in path.name else feeler.Antenna(**_SMALL), path)
    elif path.suffix == ".safetensors":
        save_model(Model(kind="lda", version=1, arrays={"a": np.ones((2, 3))}, settings={"x": [1, "y"]}), path)
    elif path.suffix == ".npz":
        encoder = ConvolutiveNMF(n_components=2, n_lags=3, max_iter=3, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            save_encoder(encoder.fit(np.random.default_rng(0).random((2, 4, 12))), path)
    elif path.suffix == ".json":
        from feeler.robot.sensor import save_calibration

        save_calibration(load_calibration_table(_put(path.with_name("t.csv"), TABLE)), path)
    else:
        save(make_tensors(), path)


def _put(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


_SMALL = {
    **{"segment_length": [1.0, 2.0, 3.0], "segment_mass": 1e-3, "radius": 0.2},
    **{"stiffness": [3.0, 2.0, 1.0], "damping": 1.0, "name": 'a "name"'},
}


def check(dataset) -> None:
    find_breaches(dataset)


READERS = {
    "antenna": (in_file(load_antenna), file_seeds("small.toml")),
    "recording": (in_file(lambda p: load_recording(p, n_channels=None)), lambda: [RECORDING]),
    "tracks": (in_file(lambda p: load_tracks(p, frame_rate=30.0)), lambda: [DLTDV, NAMED]),
    "sensor table": (in_file(load_calibration_table), lambda: [TABLE]),
    "sensor calibration": (in_file(load_calibration), file_seeds("c.json")),
    "targets": (in_file(load_targets), lambda: [TARGETS]),
    "stream": (lambda data, _: parse_sample(data, 3), lambda: SAMPLES),
    "csv": (in_file(lambda p: check(load_csv(p, LIMITS))), file_seeds("one.csv")),
    "mat": (in_file(lambda p: check(load_mat(p, LIMITS))), file_seeds("set.mat")),
    "model": (in_file(lambda p: read_model(p, LIMITS)), file_seeds("m.safetensors")),
    "encoder": (in_file(load_encoder), file_seeds("e.npz")),
    "any": (in_file(lambda p: load(p, LIMITS)), file_seeds("one.csv", "set.mat", "m.safetensors", "long.toml")),
}


@cache
def seeds_of(name: str) -> list[bytes]:
    return READERS[name][1]()


@pytest.fixture(scope="module")
def folder():
    path = Path(tempfile.mkdtemp(dir=MEMORY))
    yield path
    shutil.rmtree(path)


def attack(name: str, seed: int, folder: Path) -> None:
    rng, reader = np.random.default_rng(seed), READERS[name][0]
    for _ in range(PER_EXAMPLE):
        data = mutate(rng, seeds_of(name))
        with survives(data):
            reader(data, folder)


numbers = st.integers(0, 2**63)


@pytest.mark.parametrize("name", READERS)
def test_readers_survive(name, folder):
    for seed in seeds_of(name):
        if name != "any":  # the good file is read; `any` is also given files that hold no tensors
            READERS[name][0](seed, folder)

    @QUICK
    @given(numbers)
    def fuzz(seed):
        attack(name, seed, folder)

    fuzz()


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_readers_survive_a_hundred_thousand_inputs(name, folder):
    @LONG
    @given(numbers)
    def fuzz(seed):
        attack(name, seed, folder)

    fuzz()


def write_folder(kind: str, path: Path) -> dict[str, bytes]:
    """A store or a plain Zarr group, as its files."""
    if kind == "store":
        save(make_tensors(), path)
    else:
        make_tensors().drop_vars(["feature", "antenna", "source", "axis"]).to_zarr(
            path, zarr_format=3, consolidated=False
        )
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


FOLDERS = {"store": read_store, "zarr": load_zarr}


@cache
def files_of(kind: str) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
        return write_folder(kind, Path(folder, "set.zarr"))


def attack_folder(kind: str, seed: int, folder: Path) -> None:
    rng, path = np.random.default_rng(seed), folder / kind
    if not path.exists():
        for name, data in files_of(kind).items():
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            (path / name).write_bytes(data)
    files = files_of(kind)
    for _ in range(PER_EXAMPLE):
        names = rng.choice(list(files), size=int(rng.integers(1, 3)))
        for name in names:
            (path / name).write_bytes(mutate(rng, [files[name]]))
        if rng.random() < 0.1:
            (path / names[0]).unlink()
        with survives({name: (path / name).read_bytes() for name in names if (path / name).exists()}):
            check(FOLDERS[kind](path, LIMITS))
        for name in names:
            (path / name).write_bytes(files[name])


@pytest.mark.filterwarnings("ignore:The data type")
@pytest.mark.parametrize("kind", FOLDERS)
def test_folders_survive(kind, folder):
    @QUICK
    @given(numbers)
    def fuzz(seed):
        attack_folder(kind, seed, folder)

    fuzz()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The data type")
@pytest.mark.parametrize("kind", FOLDERS)
def test_folders_survive_a_hundred_thousand_inputs(kind, folder):
    @LONG
    @given(numbers)
    def fuzz(seed):
        attack_folder(kind, seed, folder)

    fuzz()


def open_damaged(seed: int, folder: Path) -> None:
    """Opening for writing must survive too, and what it then holds must be readable."""
    rng, files = np.random.default_rng(seed), files_of("store")
    path = folder / f"writing{seed}"
    for name, data in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(data)
    name = rng.choice(list(files))
    (path / name).write_bytes(mutate(rng, [files[name]]))
    whole = make_tensors()
    try:
        with open_store(path, {"configuration": whole.attrs["configuration"]}, 2, LIMITS) as store:
            for index in {0, 1} - store.finished:
                store.append(index, whole.isel(trial=[index]))
            assert store.read().angle.equals(whole.angle)
    except FeelerError as error:
        assert str(error)
    shutil.rmtree(path)


@pytest.mark.filterwarnings("ignore:trial .* will be computed again")
@pytest.mark.parametrize("n", [40, pytest.param(20_000, marks=pytest.mark.slow)])
def test_a_damaged_store_can_be_opened_and_healed_or_is_refused(n, folder):
    for seed in range(n):
        with survives(seed):
            open_damaged(seed, folder)


def attack_hdf5(first: int, n: int, seeds: list[bytes], folder: Path, out: int) -> None:
    """In a process that may crash: tell the number of each input before it is read."""
    for number in range(first, n):
        os.write(out, b"%d\n" % number)
        data = mutate(np.random.default_rng(number), seeds)
        (folder / "input.nc").write_bytes(data)
        with survives(number):
            arrays, notes = read_file(str(folder / "input.nc"), LIMITS)
            build_dataset(arrays, notes, "input.nc")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("n", [150, pytest.param(100_000, marks=pytest.mark.slow)])
def test_the_hdf5_reader_raises_nothing_else_and_crashes_are_contained(n, folder):
    seeds, number, crashes = file_seeds("set.nc")(), 0, 0
    while number < n:
        lines, out = os.pipe()
        pid = os.fork()
        if pid == 0:
            code = 0
            try:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                attack_hdf5(number, n, seeds, folder, out)
            except BaseException as error:
                os.write(2, repr(error)[:2000].encode())
                code = 3
            os._exit(code)
        os.close(out)
        with os.fdopen(lines, "rb") as stream:
            told = stream.read().split()
        _, status = os.waitpid(pid, 0)
        assert not os.WIFEXITED(status) or os.WEXITSTATUS(status) == 0, f"input {told[-1]} raised"
        crashes += os.WIFSIGNALED(status)
        number = int(told[-1]) + 1
    print(f"{n} damaged HDF5 files: {crashes} crashed the library's own process")
