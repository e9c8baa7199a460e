"""Feeler starts wherever Python does, and on what its core depends on alone: whatever needs more
says in one line what to install.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import MissingDependencyError
from feeler.plotting.antennas import write_movie

ROOT = Path(__file__).parents[2]
UNIX = ("fcntl", "resource", "termios", "pwd", "grp", "pty", "curses")
LIBRARIES = {
    "mujoco": ("mujoco",),
    "store": ("zarr", "filelock"),
    "models": ("safetensors",),
    "studio": ("websockets",),
    "pdf": ("pypdf",),
    "cnn": ("torch",),
    "robot": ("serial",),
    "ros": ("mcap", "mcap_ros2", "rosbags"),
    "outlines": ("svgpathtools",),
    "meshes": ("trimesh", "coacd", "fast_simplification"),
    "movie": ("imageio_ffmpeg",),
    "nwb": ("pynwb", "ndx_pose"),
    "active": ("gymnasium",),
    "notebook": ("anywidget",),
    "cluster": ("dask", "distributed"),
    "design": ("cma",),
    "parquet": ("pyarrow",),
}
CALLS = [
    *(("mujoco", words) for words in ("export x.xml", "touch --engine mujoco --out o")),
    ("store", "touch --store s.zarr --size 1 --size 2"),
    ("store", "convert t.nc t.zarr"),
    ("models", "info m.safetensors"),
    ("studio", "studio --no-open --port 0"),
    ("all", "reproduce --scale smoke --out r"),
    ("cnn", "feeler.decoding.network:import_torch"),
    ("robot", "feeler.robot.stream:open_serial nowhere"),
    *(("ros", f"feeler.tensors.bags:describe_bag {name}") for name in ("a.mcap", "a.db3")),
    ("outlines", "touch --feature outline --outline x.svg"),
    ("meshes", "touch --feature mesh:file=x.stl"),
    ("nwb", "convert t.nc t.nwb"),
    ("active", "import feeler.active.environment"),
    ("notebook", "feeler.studio.server:show_studio cockroach"),
    ("cluster", "touch --store s.zarr --size 1 --size 2 --cluster tcp://127.0.0.1:9"),
    ("design", "design d.toml --out d"),
    ("parquet", "convert t.nc t.parquet"),
]
WORK = ["info t.nc", "validate t.nc", "convert t.nc t.mat", "touch --out o --duration 20"]
ALONE = """
import importlib, json, pkgutil, sys, warnings
from importlib.abc import MetaPathFinder

hidden, unix, calls = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(unix))


class Hide(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in hidden:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, Hide())
find, importlib.util.find_spec = importlib.util.find_spec, lambda name, *more: (
    None if name.partition(".")[0] in hidden else find(name, *more))
import feeler
from typer.testing import CliRunner
from feeler.cli.app import app
from feeler.tensors.formats import save

trial = feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.5, speed=0.6)
tensors = feeler.touch(feeler.presets.cockroach(), trial, duration=2.0)
feeler.ConvolutiveNMF(n_components=1, n_lags=2, max_iter=2).fit(abs(tensors["angle"]).values)
save(tensors, "t.nc")
open("m.safetensors", "wb").write(bytes([2, *[0] * 7]) + b"{}")
open("x.svg", "w").write("<svg/>"), open("x.stl", "w").write("solid")
warnings.simplefilter("ignore")


def ask(words):
    first, *more = words.split()
    try:
        if first == "import":
            importlib.import_module(*more)
        elif ":" in first:
            module, name = first.split(":")
            getattr(importlib.import_module(module), name)(*more)
        else:
            result = CliRunner().invoke(app, [first, *more])
            if isinstance(result.exception, SystemExit):
                return result.output.strip()
            if result.exception:
                raise result.exception
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return ""


print(json.dumps({words: ask(words) for words in calls}))
"""


def run_alone(calls, folder):
    """What each call raises where only the core's libraries are to be had."""
    hidden = [name for names in LIBRARIES.values() for name in names]
    asked = json.dumps([hidden, UNIX, calls])
    done = subprocess.run(
        [sys.executable, "-c", ALONE, asked], capture_output=True, text=True, cwd=folder
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    folder = tmp_path_factory.mktemp("alone")
    made = CliRunner().invoke(app, ["design", str(folder / "d.toml"), "--new"])
    assert made.exit_code == 0, made.output
    return run_alone([*(words for _, words in CALLS), *WORK], folder)


@pytest.mark.long
@pytest.mark.parametrize("words", WORK)
def test_the_core_is_enough(alone, words):
    assert alone[words] == ""


@pytest.mark.long
@pytest.mark.parametrize(("extra", "words"), CALLS)
def test_what_needs_an_extra_names_it(alone, extra, words):
    assert f"pip install 'feeler[{extra}]'" in alone[words]
    assert "\n" not in alone[words] and "Traceback" not in alone[words]


def test_a_movie_without_its_extra_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'feeler\[movie\]'"):
        write_movie(tmp_path / "a.mp4", Figure(), lambda k: None, 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_every_module_loads_or_names_its_extra(tmp_path):
    source = ROOT / "src"
    modules = [
        ".".join(path.relative_to(source).with_suffix("").parts)
        for path in sorted(source.rglob("*.py"))
        if path.name not in ("__init__.py", "__main__.py")
    ]
    said = run_alone([f"import {name}" for name in modules], tmp_path)
    other = {name: words for name, words in said.items() if words}
    assert {
        name for name, words in other.items() if "pip install 'feeler[" not in words
    } == set()
    assert len(other) <= 6


def test_every_extra_of_a_task_is_asked_here():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    tasks = {*extras} - {
        *["all", "biologist", "bench", "lab", "check", "audit", "docs", "test"]
    }
    assert tasks == {*LIBRARIES} and tasks - {"pdf", "movie"} <= {extra for extra, _ in CALLS}
