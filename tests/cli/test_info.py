"""``feeler info`` knows every kind of file that some verb reads."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app

TRACKS = Path(__file__).parents[1] / "tracking" / "data"
ROBOT = Path(feeler.__file__).parent / "robot" / "data"


def say(*arguments):
    found = CliRunner().invoke(app, list(map(str, arguments)))
    return found.exit_code, found.output.replace("\n", " ") + str(found.exception or "")


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Files as the verbs and other people write them, by name."""
    monkeypatch.chdir(tmp_path)
    assert say("robot", "new", "mine.toml")[0] == say("design", "--new", "plan.toml")[0] == 0
    Path("rec.csv").write_text("time_ms,hinge1_deg,hinge2_deg\n0,1,2\n1,2,3\n2,3,4\n")
    Path("table.csv").write_text("head_x,head_y\n1,2\n2,3\n")
    newer = Path("mine.toml").read_text().replace("feeler.robot/1", "feeler.robot/9")
    Path("newer.toml").write_text(newer)
    Path("other.csv").write_text("a,b\n1,2\n")
    for name in ("DLC_one.csv", "DLC_one.h5", "DLC_two.h5"):
        (tmp_path / name).write_bytes((TRACKS / name).read_bytes())
    for name in ("surrogate_ball_tip_fast.csv",):
        (tmp_path / name).write_bytes((ROBOT / name).read_bytes())
    return tmp_path


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mine.toml", ("robot (TOML)", "hinges      8, 64 mm")),
        ("plan.toml", ("design (TOML)", "locations   0.5, 0.7, 0.9", "noise       relative:1")),
        ("rec.csv", ("recording of a robot", "channels    2, angle", "samples     3 over 2 ms")),
        ("surrogate_ball_tip_fast.csv", ("channels    8, capacitance", "feature ball")),
        ("table.csv", ("tracks of landmarks", "landmarks   head", "frame rate not in the file")),
        ("DLC_one.csv", ("left_tip, right_tip, head, abdomen", "frames      50", "DeepLabCut")),
        ("DLC_one.h5", ("left_tip, right_tip, head, abdomen", "frames      50", "DeepLabCut")),
        ("DLC_two.h5", ("choose one of one, two",)),
    ],
)
def test_every_input_says_what_it_holds(files, name, words):
    code, said = say("info", files / name)
    assert code == 0, said
    assert all(word in said for word in words), said


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("newer.toml", "schema must be 'feeler.robot/1', got 'feeler.robot/9'"),
        ("other.csv", "is no file of feeler"),
    ],
)
def test_what_cannot_be_read_is_refused_by_its_own_reader(files, name, words):
    code, said = say("info", files / name)
    assert code != 0 and words in said
