"""Every verb on small, awkward input, and what a person gets of it: the exit code, the words, and
the content of each file, as lines of text.

``make golden`` keeps a meant change anew and prints what has changed, for review.
"""

import json
import re
import shlex
import sys
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
import xarray as xr
from PIL import Image

from feeler.calibration import load_traces
from tests import golden

from ._command import run

KEPT = Path(__file__).with_name("golden.txt")
TOLERANCES = {
    r"tradeoff.csv: soft,0.3,.*,((30|50|75) ms|(9.6|14.4|36) mm),": (
        0.5,
        0.05,
        "a window that ends where two samples are as near: another processor takes the other",
    ),
    r"tradeoff.csv: ": (2e-3, 0, "another processor's last digits, in many draws"),
}
"""Lines whose numbers may be off further: relative, absolute, and why; found by a run with another
BLAS kernel and compiler target (OPENBLAS_CORETYPE=Nehalem NUMBA_CPU_NAME=generic), and by runs on
processors with and without AVX-512."""
VERBS = Path(__file__).with_name("golden_verbs.txt")
"""One command a line; they share a folder."""
OBJECTS = """[[object]]
name = "bolt"
shape = "ball"
radius = 3

[[object]]
name = "nut"
shape = "box"
half_width = 2
half_height = 1
"""
DESIGN = """schema = "feeler.design/1"
antenna = "soft.toml"
[task]
objects = ["ball:radius=1.5", "box:half_width=1.5,half_height=2"]
locations = [0.6, 0.9]
speeds = [0.6]
deadline = 15
noise = "relative:0.5"
train = 2
test = 2
[task.seeds]
optimiser = 1
test = 2
final = 3
[space]
stiffness = 1
damping = 1
span = 10
[search]
evaluations = 4
starts = 2
"""


def write_input(folder: Path) -> None:
    """What the verbs read."""
    rng = np.random.default_rng(7)
    (folder / "objects.toml").write_text(OBJECTS)
    (folder / "task.toml").write_text(DESIGN)
    walk = files("feeler.tracking") / "data" / "synthetic_tracks_xypts.csv"
    (folder / "walk_xypts.csv").write_bytes(walk.read_bytes())
    time = np.arange(40)
    names = [f"{name}_{axis}" for name in ("base", "p1", "p2", "tip") for axis in "xy"]
    sway = 100 + 80 * np.arange(8) / 7 + np.sin(time[:, None] / 5) * np.arange(8) * 3
    rows = [",".join(f"{x:.3f}" for x in row) for row in sway + rng.normal(0, 0.2, sway.shape)]
    (folder / "lash.csv").write_text("\n".join([",".join(names), *rows, ""]))
    traces = load_traces("synthetic_step")
    rows = np.vstack([traces.time, traces.displacement[:2]]).T[::2]
    lines = [",".join(f"{x:.5f}" for x in row) for row in rows]
    (folder / "releases.csv").write_text("\n".join(["time_ms,one,two", *lines, ""]))


def run_verbs(folder: Path) -> list[str]:
    """What all verbs give, in one folder."""
    write_input(folder)
    lines: list[str] = []
    for words in VERBS.read_text(encoding="utf-8").splitlines():
        known = _list_files(folder)
        with golden.drawing(figures := {}):
            ended = run(*shlex.split(words), cwd=folder)
        lines += [f"# feeler {words}", f"code {ended.returncode}"]
        lines += _read_words(ended.stdout) + _read_words(ended.stderr)
        new = [path for path, made in _list_files(folder).items() if known.get(path) != made]
        lines += [f"{path.relative_to(folder)}: {line}" for path in new for line in read(path)]
        lines += [f"{name}: {line}" for name, found in figures.items() for line in found]
    return [_mask(line.replace(str(folder), "FOLDER")) for line in lines]


def _list_files(folder: Path) -> dict[Path, int]:
    """Files, a store as one, and when each was written last."""
    found = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    stores = {path.parent for path in found if path.name == "zarr.json"}
    whole = [path for path in stores if not any(other in stores for other in path.parents)]
    single = [path for path in found if not any(store in path.parents for store in whole)]
    return {path: path.stat().st_mtime_ns for path in sorted([*single, *whole])}


def _read_words(text: str) -> list[str]:
    """Lines as they are; JSON value by value."""
    try:
        content = json.loads(text)
    except ValueError:
        lines = (" ".join(line.split()) for line in text.splitlines())
        return [line for line in lines if line and not line.startswith("compiling ")]
    return _read_values(content)


def _read_values(content: object) -> list[str]:
    """Lists of numbers as a digest, lists of records one by one."""
    if isinstance(content, list) and any(isinstance(item, dict) for item in content):
        content = {f"{k}": item for k, item in enumerate(content)}
    lines = []
    for name, leaf in golden.list_leaves(content):
        nested = isinstance(leaf, list) and any(isinstance(item, dict) for item in leaf)
        found = _read_values(leaf) if nested else [_write(leaf)]
        lines += [f"{name} = {line}" for line in found]
    return lines


def _write(leaf: object) -> str:
    try:
        return golden.digest(leaf) if isinstance(leaf, list) else golden.write(leaf)
    except (TypeError, ValueError):
        return golden.write(leaf)


def read(path: Path) -> list[str]:
    """What a file holds."""
    reader = READERS.get(path.suffix)
    return reader(path) if reader else []


def _read_table(path: Path) -> list[str]:
    """Words as they are; the numbers of each column as a digest."""
    lines, rows = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        cells = line.split(",")
        try:
            rows.append([float(cell or "nan") for cell in cells])
        except ValueError:
            lines.append(line)
    widths = sorted({len(row) for row in rows})
    tables = {n: np.array([row for row in rows if len(row) == n]) for n in widths}
    return lines + [
        f"column {k + 1} of {n}: {golden.digest(tables[n][:, k])}"
        for n in widths
        for k in range(n)
    ]


def _read_set(path: Path) -> list[str]:
    opened = xr.open_zarr(path, consolidated=False) if path.is_dir() else xr.open_dataset(path)
    with opened as held:
        return [f"sizes {dict(held.sizes)}", *map(_say_array, sorted(held.variables.items()))]


def _say_array(named: tuple) -> str:
    name, x = named
    held = (
        golden.digest(x) if x.dtype.kind in "fiub" and x.size else str(x.values.tolist())[:400]
    )
    return f"{name} {x.dims} {x.dtype} {x.attrs}: {held}"


def _read_hdf5(path: Path) -> list[str]:
    lines: list[str] = []

    def visit(name: str, held: h5py.Group | h5py.Dataset) -> None:
        told = {
            k: v
            for k, v in held.attrs.items()
            if k not in ("object_id", "namespace", "colnames", ".specloc")
        }
        value = ""
        if isinstance(held, h5py.Dataset) and held.dtype.kind in "fiu":
            value = golden.digest(held[()])
        elif isinstance(held, h5py.Dataset) and held.dtype.kind in "OS":
            value = str(held[()])[:300]
        lines.append(f"{name} {told} {value}")

    with h5py.File(path) as held:
        held.visititems(visit)
    return [line for line in lines if "specifications" not in line]


def _read_mat(path: Path) -> list[str]:
    from scipy.io import loadmat

    held = loadmat(path)
    return [
        f"{name} {np.shape(x)}: "
        + (golden.digest(x) if np.asarray(x).dtype.kind in "fiu" else str(x)[:300])
        for name, x in sorted(held.items())
        if not name.startswith("__")
    ]


def _read_picture(path: Path) -> list[str]:
    """How bright the picture is, in 36 fields."""
    grey = Image.open(path).convert("L")
    fields = np.asarray(grey.resize((6, 6), Image.Resampling.BOX))
    return [f"{grey.width} x {grey.height}, fields {golden.digest(fields)}"]


def _read_text(path: Path) -> list[str]:
    """Lines; neighbours that differ only in numbers as one, with a digest."""
    lines: list[str] = []
    written = filter(str.strip, path.read_text(encoding="utf-8").splitlines())
    for mask, group in groupby(written, lambda line: golden.NUMBER.sub("#", line)):
        several = list(group)
        numbers = [golden.parse(x) for line in several for x in golden.NUMBER.findall(line)]
        alike = f"{len(several)} × {mask}: {golden.digest(numbers)}"
        lines += several if len(several) < 4 and len(numbers) < 9 else [alike]
    return lines


READERS = {
    ".html": lambda path: golden.read_page(path.read_text(encoding="utf-8")),
    ".json": lambda path: _read_values(json.loads(path.read_text(encoding="utf-8"))),
    ".csv": _read_table,
    ".nc": _read_set,
    ".zarr": _read_set,
    ".nwb": _read_hdf5,
    ".mat": _read_mat,
    ".toml": _read_text,
    ".xml": _read_text,
    ".ino": _read_text,
    ".png": _read_picture,
}


def _mask(line: str) -> str:
    """Without what is another one on each day and machine: times, versions of packages, and digests
    of numbers, whose last digit is the processor's.
    """
    line = re.sub(
        r"\b\d+(\.\d+)? s\b|(?<=seconds = ).*|20\d\d-\d\d-\d\d[T ]\d\d:\d\d:\d\d[\d.:+Z]*",
        "TIME",
        " ".join(line.split()),
    )
    line = re.sub(r"\[[0-9a-f]{16}\]", "[DIGEST]", line)
    return re.sub(
        r"\bversions[ =\"':]+\{.*|python 3\.[\d.]+(, [\w-]+ [\d.]+)+", "VERSIONS", line
    )


def write_golden() -> list[str]:
    """The lines of a run in a folder of its own."""
    with TemporaryDirectory() as folder:
        return run_verbs(Path(folder).resolve())


def main() -> None:
    """Run all verbs; keep and print what has changed."""
    golden.keep(KEPT, write_golden(), TOLERANCES)


if __name__ == "__main__":
    sys.exit(main())
