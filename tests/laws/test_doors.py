"""No open door: whatever opens a file from outside does so behind the guard or within limits, and
SECURITY.md says how, kind by kind.
"""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import feeler
from feeler.design.plan import DESIGN_FILES
from feeler.objects.meshes import MESHES
from feeler.objects.outlines import LIBRARIES
from feeler.robot.recordings import ROBOT_FILES
from feeler.tensors.formats import FORMATS
from feeler.tracking.tracks import TRACK_FILES

SOURCE = Path(feeler.__file__).parent
SECURITY = SOURCE.parents[1] / "SECURITY.md"
DOORS = {"files.py", "sandbox.py"}
"""Where files may be opened: within a limit of bytes, or in a process of its own."""
OPENERS = {
    "open",
    "read_text",
    "read_bytes",
    "loads",
    "fromfile",
    "memmap",
    "genfromtxt",
    "loadtxt",
}
LIBRARIES_THAT_OPEN = {
    *("h5py", "h5netcdf", "zarr", "safetensors", "svgpathtools", "ezdxf", "mcap", "mcap_ros2"),
    *("pyarrow", "tomllib", "pickle", "pandas", "xml", "pynwb", "ndx_pose", "netCDF4", "PIL"),
    *("scipy.io", "imageio", "yaml", "torch", "neo", "sqlite3", "zipfile", "tarfile", "shelve"),
    *("marshal", "configparser", "lxml", "datasets", "cv2", "sleap_io", "nbformat", "rosbags"),
    *("trimesh", "coacd"),
}
ENDINGS = (".h5", ".nc", ".nwb", ".mcap", ".db3", ".bag")
"""Of files that feeler reads and info names by what they hold."""
OWN = {
    "__init__.py:_read_homes": "this package's own text",
    "antenna/animals.py:read_species": "ships with feeler",
    "antenna/animals.py:_read_rows": "ships with feeler",
    "calibration/traces.py:load_traces": "ships with feeler; the user's go through read_table",
    "cli/robot.py:example": "ships with feeler",
    "cli/robot_live.py:board": "ships with feeler",
    "studies/paper/calibration_report.py:_load_searches": "ships with feeler",
    "studies/shipped.py:read_shipped": "ships with feeler",
    "studies/paper/kept.py:": "what an earlier run has drawn, and what ships with feeler",
    "studio/export.py:film": "what it has just drawn itself",
    "report/page.py:render_page": "ships with feeler",
    "studio/export.py:read_page": "ships with feeler",
    "provenance.py:describe_code": "this package's own files",
    "provenance.py:parse_module": "this package's own code, parsed and not run",
    "provenance.py:_open_notes": "kept beside Python's own compiled files, which Python runs",
    "studies/contests/contest.py:_describe_own": "a program of the user's, who has it run",
    "execute/processes.py:": "pickles over private pipes to our own workers; the system's words",
    "tensors/readers.py:": "pickle is held back by a class of our own, in the guard's process",
    "plotting/movie.py:": "writes",
    "report/page.py:": "writes",
    "report/page.py:Section.load": "what an earlier run of the same folder wrote",
    "report/page.py:": "figures that a run has drawn, or that ship with feeler",
    "report/page.py:_embed": "a figure that a run has drawn",
    "studies/paper/report.py:_copy_figures": "a figure that this run has drawn",
    "studio/session.py:read_message": "a message of at most 8 MiB, cut by the server",
    "studio/session.py:Session._listen": "a serial port that the system lists",
    "tensors/writers.py:describe_whole": "text that was written a line before",
    "tensors/transforms.py:Views.antenna": "an attribute that has passed the validator",
    "tensors/stored.py:Layout.make_shared": "a record that has passed the validator",
    "tensors/stored.py:check_shards": "compared with its digest before anything is made of it",
    "files.py:sync_folder": "no file: the folder's list of names",
    "tensors/stored.py:": "a store is read chunk by chunk, each against its checksum",
    "tensors/stored.py:_open_copies": "a store is read chunk by chunk, each against its checksum",
    "tensors/writers.py:": "writes",
    "tensors/writers.py:": "writes",
    "tensors/models.py:save_model": "writes",
    "tracking/tracks.py:": "writes",
    "learn/export.py:export_parquet": "writes",
    "decoding/network.py:": "trains networks; its files are read as safetensors",
}
"""What opens files and is no door, and why that is safe."""


def list_files():
    return sorted(SOURCE.rglob("*.py"))


def find_calls(tree):
    """Every function's name with the calls and imports that stand in it."""

    def visit(node, name):
        for child in ast.iter_child_nodes(node):
            inner = name
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                inner = f"{name}.{child.name}".lstrip(".")
            if isinstance(child, ast.Call | ast.Import | ast.ImportFrom):
                yield name, child
            yield from visit(child, inner)

    return list(visit(tree, ""))


def name_call(node):
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def is_writing(node):
    modes = [
        m for m in re.findall(r"'([rwaxb+]{1,3})'", ast.unparse(node)) if set(m) & set("wax")
    ]
    return bool(modes)


def opens(node):
    """What a call or an import opens files with; "" where it does not."""
    if isinstance(node, ast.Call):
        name, whose = name_call(node), ast.unparse(node.func)
        away = whose in ("read_text", "read_bytes", "webbrowser.open") or is_writing(node)
        return name if name in OPENERS and not away else ""
    named = (
        [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    )
    parts = {name.split(".")[0] for name in named} | {*named}
    return next(iter(parts & LIBRARIES_THAT_OPEN), "")


@cache
def find_guarded():
    """Every function that is handed to the guard, as module and name."""
    found = set()
    for path in list_files():
        module = ".".join(("feeler", *path.relative_to(SOURCE).with_suffix("").parts))
        for _, node in find_calls(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and name_call(node) in ("open_guarded", "guarded"):
                text = ast.unparse(node.args[0]).replace("{__name__}", module)
                if match := re.search(r"(feeler[\w.]*):(\w+)", text):
                    found.add(match.groups())
    return found


def list_behind(module, tree):
    """The functions of a module that run in the guard's process: those handed to it, and what they
    call there.
    """
    calls, behind = find_calls(tree), {name for home, name in find_guarded() if home == module}
    known = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    while True:
        more = {
            used.id
            for node in tree.body
            if isinstance(node, ast.FunctionDef) and node.name in behind
            for used in ast.walk(node)
            if isinstance(used, ast.Name) and used.id in known
        }
        tables = {
            used.id
            for node in tree.body
            if isinstance(node, ast.Assign | ast.AnnAssign) and behind
            for used in ast.walk(node)
            if isinstance(used, ast.Name) and used.id in known
        }
        if more | tables <= behind:
            return behind, calls
        behind |= more | tables


def find_open():
    """Every place outside the doors that opens files: ``file:function`` and with what."""
    for path in list_files():
        file = path.relative_to(SOURCE).as_posix()
        if file in DOORS:
            continue
        module = ".".join(("feeler", *path.relative_to(SOURCE).with_suffix("").parts))
        behind, calls = list_behind(module, ast.parse(path.read_text()))
        for name, node in calls:
            if (what := opens(node)) and name.split(".")[0] not in behind:
                yield f"{file}:{name}", what


@pytest.mark.long
def test_nothing_opens_a_file_from_outside_but_through_a_door():
    found = {place: what for place, what in find_open()}
    assert {place: what for place, what in found.items() if not excuses(place) & {*OWN}} == {}
    assert {*OWN} - {one for place in found for one in excuses(place)} == set()


def excuses(place):
    """What in ``OWN`` would excuse a place: itself, or its file."""
    return {place, f"{place.partition(':')[0]}:"}


def test_the_guard_is_handed_functions_that_are_there():
    assert len(find_guarded()) >= 8
    for module, name in find_guarded():
        assert callable(getattr(__import__(module, fromlist=[name]), name))


@pytest.mark.parametrize(
    "planted",
    [
        "def f(path):\n    return open(path).read()",
        "def f(path):\n    return path.read_text()",
        "def f(path):\n    import h5py\n    return h5py.File(path)",
        "import pickle",
        "def f(path):\n    return np.loadtxt(path)",
        "def f(path):\n    return json.loads(path)",
    ],
)
def test_a_new_opener_would_be_noticed(planted):
    assert any(opens(node) for _, node in find_calls(ast.parse(planted)))


def list_kinds():
    """What ``feeler info`` calls each kind of file, and the endings of others."""
    formats = {**FORMATS, **ROBOT_FILES, **TRACK_FILES, **DESIGN_FILES}
    return {form.words for form in formats.values()} | {*LIBRARIES, *MESHES, *ENDINGS}


def test_security_lists_every_kind_of_file_beside_its_guard():
    text = SECURITY.read_text()
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    missing = {kind for kind in list_kinds() if not any(kind in row for row in rows)}
    assert missing == set()
    told = {name for row in rows for name in re.findall(r"`(feeler[\w.]*:\w+)`", row)}
    assert told == {f"{module}:{name}" for module, name in find_guarded()}
