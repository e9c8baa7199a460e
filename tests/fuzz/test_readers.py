"""Every reader of one file against damaged and hostile input: no crash, no hang, only feeler's own
errors.

Input ``number`` of a reader is made from a generator seeded with that number, so that a failure can
be repeated.
"""

import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from feeler import Outline
from feeler.antenna.files import load_antenna
from feeler.calibration.problem import load_targets
from feeler.calibration.traces import load_traces
from feeler.decoding.network import TouchNetwork
from feeler.decoding.streams import StreamDecoder
from feeler.design.plan import TEMPLATE, load_plan
from feeler.encoding import load_encoder
from feeler.objects import load_objects
from feeler.provenance import _read_journal
from feeler.robot.description import load_robot
from feeler.robot.recordings import load_recording
from feeler.robot.repair import repair
from feeler.robot.sensors import load_calibration, load_calibration_table
from feeler.robot.stream import _parse_sample, read_samples
from feeler.sandbox import Limits
from feeler.tensors.formats import _read_model, describe_file, find_problems
from feeler.tracking.tracks import load_tracks

from . import _files as files
from ._mutate import (
    mutate,
    shape_json,
    shape_safetensors,
    shape_text,
    shape_toml,
)
from ._survive import Log, survives, watched

pytestmark = pytest.mark.long

N_QUICK = 200
LIMITS = Limits(max_bytes=2**22)
Shape = Callable[[np.random.Generator, bytes], bytes]


@dataclass(frozen=True)
class Reader:
    """What reads a file, good files as makers of bytes, and what changes their structure."""

    read: Callable[[Path], object]
    seeds: tuple[bytes | str, ...]
    shape: Shape | None = None
    name: str = "input"

    def make_seeds(self) -> list[bytes]:
        return [files.make_file(seed) if isinstance(seed, str) else seed for seed in self.seeds]


def read_stream(path: Path) -> None:
    """A whole stream of lines, as from a serial port, through the decoder."""
    running = files.make_decoder().start()
    for time, values in read_samples(path.read_bytes().split(b"\n"), 3):
        running.update(values, time)


def look(path: Path) -> None:
    """What ``feeler info`` and ``feeler validate`` do."""
    find_problems(path, LIMITS)
    describe_file(path, LIMITS)


def load_landmarks(path: Path) -> None:
    load_tracks(path, frame_rate=30.0, landmarks=("head", "abdomen"), origin="bottom-left")


READERS = {
    "antenna": Reader(load_antenna, ("small.toml", "sensors.toml"), shape_toml),
    "robot": Reader(load_robot, ("robot.toml",), shape_toml),
    "plan": Reader(load_plan, (TEMPLATE.encode(),), shape_toml),
    "objects": Reader(load_objects, (files.OBJECTS,), shape_toml),
    "svg": Reader(
        lambda path: Outline.from_file(path, width=3.0),
        (files.DRAWING, files.SHAPES),
        shape_text,
        "input.svg",
    ),
    "svg scaled": Reader(
        lambda path: Outline.from_file(path, tolerance=1e-3),
        (files.DRAWING, files.SHAPES),
        shape_text,
        "input.svg",
    ),
    "corners": Reader(
        Outline.from_file, (b"x,y\n0,-1\n4,-1\n4,1\n0,1\n",), shape_text, "input.csv"
    ),
    "recording": Reader(
        lambda path: repair(load_recording(path, n_channels=None), gaps="bridge"),
        (files.RECORDING, files.CAPACITANCE),
        shape_text,
    ),
    "bag": Reader(lambda path: load_recording(path, n_channels=None), ("run.mcap",)),
    "tracks": Reader(
        lambda path: load_tracks(path, frame_rate=30.0), (files.DLTDV, files.FOUR), shape_text
    ),
    "landmarks": Reader(load_landmarks, (files.LANDMARKS, files.NAMED), shape_text),
    "traces": Reader(load_traces, (files.TRACES,), shape_text),
    "sensor table": Reader(load_calibration_table, (files.TABLE, files.COUNTS), shape_text),
    "sensor calibration": Reader(load_calibration, ("c.json",), shape_json),
    "targets": Reader(load_targets, (files.TARGETS,), shape_toml),
    "journal": Reader(lambda path: _read_journal(path, "0a"), (files.JOURNAL,), shape_text),
    "sample": Reader(
        lambda path: _parse_sample(path.read_bytes(), 3), tuple(files.SAMPLES), shape_text
    ),
    "stream": Reader(read_stream, (files.LINES,), shape_text),
    "model": Reader(
        lambda path: _read_model(path, LIMITS), ("m.safetensors",), shape_safetensors
    ),
    "encoder": Reader(load_encoder, ("encoder.safetensors",), shape_safetensors),
    "decoder": Reader(StreamDecoder.load, ("decoder.safetensors",), shape_safetensors),
    "network": Reader(
        lambda path: TouchNetwork.load(path, device="cpu"),
        ("network.safetensors",),
        shape_safetensors,
    ),
    "look": Reader(look, ("m.safetensors", "small.toml"), shape_text),
}
MODELS = {"network"}  # need PyTorch


@pytest.fixture(scope="module")
def folder():
    path = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield path
    shutil.rmtree(path)


@pytest.fixture(params=READERS)
def reader(request):
    if request.param in MODELS:
        pytest.importorskip("torch", reason="needs the extra `cnn`")
    return READERS[request.param]


def make_input(reader: Reader, seeds: list[bytes], number: int, share: float = 0.4) -> bytes:
    """Input ``number``: of a ``share`` of them the structure changes, of the others bytes do."""
    rng = np.random.default_rng(number)
    if reader.shape and rng.random() < share:
        return reader.shape(rng, seeds[rng.integers(len(seeds))])
    return mutate(rng, seeds)


def attack(reader: Reader, numbers: range, folder: Path, share: float = 0.4) -> Log:
    """Read the inputs of these numbers."""
    log, seeds, path = Log(), reader.make_seeds(), folder / reader.name
    with watched():
        for number in numbers:
            data = make_input(reader, seeds, number, share)
            path.write_bytes(data)
            with survives(data, log, library=True):
                reader.read(path)
    return log


def test_good_files_are_read(reader, folder):
    good = [
        seed for seed in reader.make_seeds() if seed != files.NAMED
    ]  # NAMED has no abdomen: a start for damage
    assert good
    for seed in good:
        (folder / reader.name).write_bytes(seed)
        reader.read(folder / reader.name)


def test_readers_survive(reader, folder):
    log = attack(reader, range(N_QUICK), folder)
    least = 0.2 if reader.read is not read_stream else 0.0  # of a stream bad lines are counted
    assert log.ends["refused"] >= least * N_QUICK  # else nothing was damaged
    assert log.ends["read"] > 0  # else nothing got past the first check


@settings(
    max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
@given(
    data=st.binary(max_size=300)
    | st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace"))
)
def test_readers_survive_anything(reader, folder, data):
    (folder / reader.name).write_bytes(data)
    with watched(), survives(data, Log()):
        reader.read(folder / reader.name)
