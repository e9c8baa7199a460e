"""The page's own functions, run by node without a page, against what Python makes of the same."""

import base64
import json
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from feeler.presets import make_preset
from feeler.studio.catalogue import describe_original
from feeler.studio.messages import pack
from feeler.studio.wish import AntennaWish

TESTS = Path(__file__).with_name("page.test.mjs")
WISHES = (
    {"preset": "linear"},
    {"preset": "exponential", "stiffness": [[0, 20], [0.37, 3], [1, 0.01]]},
    {"preset": "linear", "stiffness": [[0, 9], [0.2, 5], [1, 0.02]], "matched": True},
    {"preset": "robot", "damping": [[0, 8], [1, 0.4]]},
)


def make_given():
    """Inputs, and what Python says of them."""
    rng = np.random.default_rng(3)
    arrays = {
        "angle": rng.normal(size=(7, 3)).astype("<f4"),
        "contact": rng.normal(size=7).astype("<f4"),
    }
    packed = {
        name: {"shape": list(a.shape), "values": a.ravel().astype(float).tolist()}
        for name, a in arrays.items()
    }
    curves = []
    for wish in WISHES:
        made = AntennaWish.from_plain(wish).make()
        curves.append(
            {
                "wish": wish,
                "original": describe_original(make_preset(wish["preset"])),
                "stiffness": made.stiffness.tolist(),
                "damping": made.damping.tolist(),
            }
        )
    content = base64.b64encode(pack({"part": "piece"}, **arrays)).decode()
    return {
        "packed": {"content": content, "arrays": packed},
        "curves": curves,
    }


def test_the_page_s_functions_do_what_python_does(tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node: apt-get install nodejs")
    for file in files("feeler.studio").joinpath("page").iterdir():
        if file.name.endswith(".js"):
            (tmp_path / file.name).write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "given.json").write_text(json.dumps(make_given()))
    shutil.copy(TESTS, tmp_path)
    command = [node, "--test", TESTS.name]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-6000:]
    assert "# pass 10" in done.stdout
