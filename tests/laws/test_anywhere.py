"""Feeler starts wherever Python does: what only some systems or some installs have is imported
where it may be missing.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import feeler
from feeler.errors import MissingDependencyError

SOURCE = Path(feeler.__file__).parent
WAITING = {
    "files.py",
    "tensors/hdf5_child.py",
    "provenance.py",
}  # until files are read through libraries
UNIX = {"fcntl", "resource", "termios", "pwd", "grp", "pty", "curses"}
EXTRAS = {
    "imageio_ffmpeg",
    "torch",
    "serial",
    "pynwb",
    "svgpathtools",
    "ezdxf",
    "trimesh",
    "coacd",
    "dask",
    "distributed",
    "IPython",
}


def find_bare_imports(tree: ast.AST) -> set[str]:
    """Top-level packages imported when the module is, with nothing that catches their absence."""
    bare: set[str] = set()
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            bare |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            bare.add((node.module or "").split(".")[0])
        elif not (
            isinstance(node, ast.Try | ast.FunctionDef)
            or (isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING")
        ):
            bare |= find_bare_imports(node)
    return bare


@pytest.mark.long
def test_nothing_that_may_be_missing_is_imported_unguarded():
    bare = {
        path.relative_to(SOURCE).as_posix(): find_bare_imports(ast.parse(path.read_text()))
        for path in SOURCE.rglob("*.py")
    }
    missing = UNIX | EXTRAS
    assert {file: found & missing for file, found in bare.items() if found & missing} == {}


def test_workers_do_without_limits_where_there_are_none():
    code = (
        "import sys; sys.modules['resource'] = None\n"
        "import feeler.execute.processes as p, feeler.physics.run\n"
        "assert p.resource is None\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_movie_without_its_extra_says_what_to_install(monkeypatch, tmp_path):
    from matplotlib.figure import Figure

    from feeler.plotting.movie import write_movie

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'feeler\[movie\]'"):
        write_movie(tmp_path / "a.mp4", Figure(), lambda k: None, 1)
    assert not list(tmp_path.iterdir())
