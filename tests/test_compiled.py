"""Compiled code on disk follows all that it calls, and is kept wherever there is room for it."""

import logging
import os
import platform
import shutil
import stat
import subprocess
import sys
import tempfile

import pytest
from numba.core import caching

from feeler import compiled as module
from feeler.compiled import compiled

pytestmark = pytest.mark.long

INNER = (
    "from feeler.compiled import compiled\nSTEP = {step}\n@compiled\ndef inner(x):\n    return x +"
    " STEP\n"
)
OUTER = (
    "from feeler.compiled import compiled\nfrom inner import inner\n@compiled\ndef outer(x): return"
    " 10 * inner(x)\n"
)


def run(
    folder,
    code="from outer import outer; print(outer(1), sum(outer.stats.cache_hits.values()))",
    **more,
):
    path = os.pathsep.join([str(folder), *sys.path])
    environment = os.environ | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": f"{folder}/cache"} | more
    process = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return process.stdout.split()


def test_a_change_in_what_is_called_is_compiled_in(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER.format(step=1))
    assert run(tmp_path) == ["20", "0"]
    (tmp_path / "other.py").write_text("x = 1\n")
    assert run(tmp_path) == ["20", "1"]
    (tmp_path / "inner.py").write_text(INNER.format(step=25))
    assert run(tmp_path) == ["260", "0"]


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names features of x86-64")
def test_code_for_fewer_features_is_used_and_code_for_more_is_not(tmp_path):
    few = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+sse2"}
    for name, first, second, hits in (("a", few, {}, "1"), ("b", {}, few, "0")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "outer.py").write_text(OUTER)
        (folder / "inner.py").write_text(INNER.format(step=1))
        assert run(folder, **first) == ["20", "0"]
        assert run(folder, **second) == ["20", hits]


def test_what_was_kept_for_a_class_that_has_another_name_now_is_compiled_anew(tmp_path):
    kept = (
        "from typing import NamedTuple\nfrom feeler.compiled import compiled\nclass"
        " {name}(NamedTuple):\n    x: float\n@compiled\ndef get(pair): return"
        " pair.x\nprint(get({name}(2.0)), sum(get.stats.cache_hits.values()))\n"
    )
    for name, hits in (("Pair", "0"), ("Couple", "0"), ("Couple", "1")):
        (tmp_path / "kept.py").write_text(kept.format(name=name))
        assert run(tmp_path, "import kept") == ["2.0", hits]


def test_kernels_run_as_plain_python(tmp_path):
    code = (
        "from feeler.encoding.measures import *; from feeler.analysis.indices import *; import"
        " feeler.robot.surrogate"
    )
    assert run(tmp_path, f"{code}; print('whole')", NUMBA_DISABLE_JIT="1") == ["whole"]


@pytest.fixture
def homeless(monkeypatch, tmp_path):
    """Neither the package's folder nor home can be written to; the temporary folder is
    ``tmp_path``.
    """
    for locator in (caching.InTreeCacheLocator, caching.UserWideCacheLocator):
        monkeypatch.setattr(locator, "from_function", classmethod(lambda *_: None))
    monkeypatch.setattr(module.config, "CACHE_DIR", "")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for remembered in (module._move_cache, module._tell):
        remembered.cache_clear()
    yield tmp_path
    module._move_cache.cache_clear()


def double(x):
    return 2 * x


def test_without_a_home_code_is_kept_in_a_folder_closed_to_others_and_that_is_said_once(
    homeless, caplog
):
    with caplog.at_level(logging.WARNING, "feeler"):
        assert [compiled(double)(2), compiled(double)(2.5)] == [4, 5.0]
    (folder,) = homeless.iterdir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert list(folder.rglob("*.nbc"))
    assert [record.message.count(str(folder)) for record in caplog.records] == [1]
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)


def test_a_folder_that_others_can_write_to_is_not_used(homeless):
    first = homeless / f"feeler-compiled-{os.getuid()}"
    first.mkdir()
    first.chmod(0o777)
    assert compiled(double)(2) == 4
    assert not list(first.iterdir())
    assert len(list(homeless.rglob("*.nbc"))) == 1


def test_without_any_folder_it_compiles_each_time_and_says_so(homeless, monkeypatch, caplog):
    monkeypatch.setattr(tempfile, "tempdir", str(homeless / "absent"))
    with caplog.at_level(logging.WARNING, "feeler"):
        assert compiled(double)(2) == 4
    assert "each process compiles anew" in caplog.text


def test_a_user_without_home_can_use_a_read_only_install():
    nobody = [
        "setpriv",
        "--reuid=65534",
        "--regid=65534",
        "--clear-groups",
        sys.executable,
        "-c",
    ]
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": "/nonexistent",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }

    def run_as_nobody(code, **more):
        return subprocess.run(
            [*nobody, code], env=environment | more, capture_output=True, text=True, check=False
        )

    if not shutil.which("setpriv") or run_as_nobody("import numba").returncode:
        pytest.skip("needs root, setpriv and a Python that others can read")
    with tempfile.TemporaryDirectory() as folder:
        shutil.chown(folder, 65534)
        done = run_as_nobody(
            "from feeler.encoding import hoyer_sparseness; print('good')", TMPDIR=folder
        )
        assert (done.stdout.strip(), done.stderr.count(folder)) == ("good", 1), done.stderr
