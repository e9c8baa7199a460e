"""A classifier of the user's own, from a file, wherever a classifier is named."""

import json

import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.cli.choose import name_classifier
from feeler.decoding import CLASSIFIERS
from feeler.decoding.classifiers import describe_classifier
from feeler.errors import InvalidInput
from tests.cli._command import run

CODE = """
from feeler.decoding import make_lda

def make():
    return make_lda({n})
"""


@pytest.fixture
def own(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(CODE.format(n=3))
    yield file
    for name in [name for name in CLASSIFIERS if str(tmp_path) in name]:
        CLASSIFIERS.unregister(name)


def test_a_function_of_a_file_gives_a_classifier_and_its_text_is_its_identity(own):
    text = f"{own}:make"
    assert CLASSIFIERS[name_classifier(text)]()[0].n_components == 3
    assert name_classifier(text) == text  # again
    before = describe_classifier(text)
    own.write_text(CODE.format(n=4))
    assert describe_classifier(text) != before
    with pytest.raises(InvalidInput, match="has no function 'other'"):
        name_classifier(f"{own}:other")
    with pytest.raises(
        InvalidInput, match=r"no file .*a classifier of your own is file.py:func"
    ):
        name_classifier(f"{own}x.py:make")
    with pytest.raises(InvalidInput, match="unknown classifier 'nobody'"):
        name_classifier("nobody")


def test_tradeoff_asks_it(own, tmp_path):
    words = ["tradeoff", "--sets", 1, "--speed", 1.2, "--classifier", f"{own}:make", "--json"]
    words += ["--out", tmp_path / "out", "--objects", "ball:radius=1.5"]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    assert f"{own}:make" in done.stdout
    assert json.loads(done.stdout[done.stdout.index("{") :])


OBJECT = """[[object]]
name = "bolt"
shape = "ball"
radius = 3.0
"""


@pytest.mark.long
def test_equal_antennas_have_equal_numbers_and_others_their_own(tmp_path):
    (tmp_path / "objects.toml").write_text(OBJECT)
    run("antenna", "twin.toml", "--preset", "robot", cwd=tmp_path)
    asked = (
        "--scale",
        "smoke",
        "--objects",
        "objects.toml",
        "--speed",
        "0.3",
        "--out",
        "c.html",
        "--json",
    )
    done = run("compare", "robot", "twin.toml", "cricket", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (
        found["antennas"] == ["robot", "twin", "cricket"]
        and "over all classes" in (tmp_path / "c.html").read_text()
    )
    measures = [
        by_antenna
        for by_antenna in found.values()
        if isinstance(by_antenna, dict) and "twin" in by_antenna
    ]
    assert len(measures) == 11
    assert all(m["robot"] == m["twin"] for m in measures) and all(
        m["robot"] != m["cricket"] for m in measures[:7]
    )
