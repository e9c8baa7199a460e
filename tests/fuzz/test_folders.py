"""Stores and Zarr groups against damaged files inside them: only feeler's own errors, reading and
writing.
"""

import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import feeler
from feeler.errors import FeelerError
from feeler.sandbox import Limits
from feeler.tensors.formats import FORMATS, save
from feeler.tensors.schema import find_errors
from feeler.tensors.store import open_store, read_store

from ._files import make_set
from ._mutate import mutate, shape_json
from ._survive import Log, survives, watched

N_QUICK = 100
LIMITS = Limits(max_bytes=2**22)
FOLDERS = {
    "store": lambda path: read_store(path).load(),
    "zarr": lambda path: FORMATS["zarr"].load(path, LIMITS, False),
}
pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore:The data type", "ignore:trials of the store"),
]


@pytest.fixture(scope="module")
def folder():
    path = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield path
    shutil.rmtree(path)


@cache
def files_of(kind: str) -> dict[str, bytes]:
    """A good store or Zarr group, as its files."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "set.zarr")
        if kind == "store":
            save(make_set(), path)
        else:
            plain = make_set().drop_vars(["feature", "antenna", "source", "axis"])
            plain.to_zarr(path, zarr_format=3, consolidated=False)
        return {
            str(file.relative_to(path)): file.read_bytes()
            for file in sorted(path.rglob("*"))
            if file.is_file()
        }


def write_files(path: Path, files: dict[str, bytes]) -> None:
    for name, data in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(data)


def damage(rng: np.random.Generator, data: bytes) -> bytes:
    if data.startswith(b"{") and rng.random() < 0.5:
        return shape_json(rng, data)
    return mutate(rng, [data])


def attack(kind: str, numbers: range, folder: Path) -> Log:
    """Read the folder with one or two of its files damaged or gone, once for each number."""
    files, path, log = files_of(kind), folder / kind, Log()
    write_files(path, files)
    read = [name for name in files if name.endswith(".json")]
    if kind == "store":
        read = ["zarr.json", "finished/c.0", "angle/c.0.0.0", "feature/c.0", "time/c.0"]
    with watched():
        for number in numbers:
            rng = np.random.default_rng(number)
            names = rng.choice(
                read if rng.random() < 0.7 else list(files), size=int(rng.integers(1, 3))
            )
            for name in names:
                (path / name).write_bytes(damage(rng, files[name]))
            if rng.random() < 0.1:
                (path / names[0]).unlink()
            with survives(f"{kind}, number {number}", log, library=True):
                find_errors(FOLDERS[kind](path))
            for name in names:
                (path / name).write_bytes(files[name])
    return log


@pytest.mark.parametrize("kind", FOLDERS)
def test_folders_survive(kind, folder):
    log = attack(kind, range(N_QUICK), folder)
    assert log.ends["refused"] > 0.2 * N_QUICK and log.ends["read"] > 0


def open_damaged(number: int, folder: Path) -> str:
    """Open a damaged store for writing: refused, or it ends with every number right."""
    rng = np.random.default_rng(number)
    files = files_of("store")
    path = folder / f"writing{number}"
    whole = make_set()
    write_files(path, files)
    name = rng.choice(list(files))
    (path / name).write_bytes(damage(rng, files[name]))
    try:
        with open_store(
            path, {"configuration": whole.attrs.get("configuration", "")}, 2
        ) as store:
            missing = np.flatnonzero(~store.finished)
            for index in missing:
                store.append([index], whole.isel(trial=[index]))
        assert feeler.load(path)["angle"].load().equals(whole["angle"])
        return "healed" if missing.size else "unhurt"
    except FeelerError as error:
        assert str(error)
        return "refused"
    finally:
        shutil.rmtree(path)


@pytest.mark.parametrize("n", [30, pytest.param(20_000, marks=pytest.mark.slow)])
def test_a_damaged_store_can_be_opened_and_healed_or_is_refused(n, folder):
    log, ends = Log(), []
    with watched():
        for number in range(n):
            with survives(f"damaged store, number {number}", log, library=True):
                ends.append(open_damaged(number, folder))
    counts = {end: ends.count(end) for end in sorted(set(ends))}
    print(f"\n{n} damaged stores opened for writing: {counts}; slowest {log.slowest:.3f} s")
    assert len(ends) == n and len(counts) == 3
