"""Compiled code on disk follows every file of its room."""

import os
import subprocess
import sys

INNER = "from feeler.compiled import compiled\nSTEP = {step}\n@compiled\ndef inner(x):\n    return x + STEP\n"
OUTER = "from feeler.compiled import compiled\nfrom inner import inner\n@compiled\ndef outer(x): return 10 * inner(x)\n"


def run(folder):
    code = "from outer import outer; print(outer(1), sum(outer.stats.cache_hits.values()))"
    environment = os.environ | {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    process = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return process.stdout.split()


def test_a_change_in_a_neighbouring_file_is_compiled_in(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)
    (tmp_path / "inner.py").write_text(INNER.format(step=1))
    assert run(tmp_path) == ["20", "0"]
    assert run(tmp_path) == ["20", "1"]
    (tmp_path / "inner.py").write_text(INNER.format(step=25))
    assert run(tmp_path) == ["260", "0"]
