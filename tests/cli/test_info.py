"""``feeler info`` knows every kind of file that some verb reads."""

from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
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
    Path("other.csv").write_text("time_ms,b,who\n1,2,me\n2,3,\n")
    Path("other.bin").write_text("no file of ours")
    Path("objects.toml").write_text('[[object]]\nname = "nut"\nshape = "ball"\nradius = 3\n')
    Path("marked.csv").write_bytes(BOM_UTF8 + (TRACKS / "DLC_one.csv").read_bytes())
    Path("two.csv").write_text(
        "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y\n1,2,3,4\n2,3,4,5\n"
    )
    places = np.arange(24.0).reshape(3, 2, 2, 2)
    names = {"space": ["x", "y"], "keypoints": ["a", "b"], "individuals": ["one", "two"]}
    moved = xr.Dataset({"position": (("time", *names), places)}, names)
    moved.to_netcdf("moved.nc", engine="h5netcdf")
    for name in ("DLC_one.csv", "DLC_one.h5", "DLC_two.h5"):
        (tmp_path / name).write_bytes((TRACKS / name).read_bytes())
    for name in ("surrogate_ball_tip_fast.csv", "surrogate_calibration_table.csv"):
        (tmp_path / name).write_bytes((ROBOT / name).read_bytes())
    return tmp_path


@pytest.mark.further
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mine.toml", ("robot (TOML)", "hinges      8, 64 mm")),
        ("plan.toml", ("design (TOML)", "locations   0.5, 0.7, 0.9", "noise       relative:1")),
        (
            "rec.csv",
            ("recording of a robot", "channels    2, angle", "samples     3 over 2 ms"),
        ),
        ("surrogate_ball_tip_fast.csv", ("channels    8, capacitance", "feature ball")),
        (
            "table.csv",
            ("tracks of landmarks", "landmarks   head", "frame rate not in the file"),
        ),
        ("objects.toml", ("objects to touch", "nut: ball, size 3 mm")),
        ("surrogate_calibration_table.csv", ("known angles", "hinges      8, readings in pF")),
        (
            "other.csv",
            (
                "a table that no command of feeler reads as it is",
                "column      b: 2 … 3",
                "column      who: text ('me' …)",
                "because     other.csv: 0 channels",
            ),
        ),
        ("DLC_one.csv", ("left_tip, right_tip, head, abdomen", "frames      50", "DeepLabCut")),
        ("DLC_one.h5", ("left_tip, right_tip, head, abdomen", "frames      50", "DeepLabCut")),
        ("DLC_two.h5", ("animals     one, two", "--individual one", "doubted     2.0%")),
        (
            "moved.nc",
            ("tracks of landmarks", "by          movement", "feeler tracks moved.nc --tips"),
        ),
        ("marked.csv", ("by          DeepLabCut", "frames      50")),
        ("two.csv", ("by          DLTdv", "camera      1 of 2", "--frame-rate RATE")),
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
        ("other.bin", "is of a kind that feeler does not know"),
        (".", "is a folder, no store of touches: name a file (DLC_one.csv"),
    ],
)
def test_what_cannot_be_read_is_refused_by_its_own_reader(files, name, words):
    code, said = say("info", files / name)
    assert code != 0 and words in said


def test_a_file_alone_asks_what_it_is_and_a_verb_stays_a_verb(files):
    assert say(files / "rec.csv") == say("info", files / "rec.csv")
    Path("touch").write_text("a file called as a verb is")
    assert "Usage" in say("touch", "--help")[1]
    code, said = say("none.csv")
    assert code == 2 and "no such file" in said


def test_one_file_that_is_unknown_does_not_hide_the_others(files):
    code, said = say("info", files / "other.bin", files / "rec.csv")
    assert (
        code == 2
        and "is of a kind that feeler does not know" in said
        and "channels    2, angle" in said
    )


@pytest.mark.long
def test_validate_reads_what_other_verbs_read_and_convert_names_the_verb(files):
    assert say("validate", "DLC_one.h5", "rec.csv", "mine.toml", "plan.toml")[0] == 0
    (files / "cut.h5").write_bytes((files / "DLC_one.h5").read_bytes()[:5000])
    code, said = say("validate", "cut.h5")
    assert code == 1 and "damaged" in said
    code, said = say("convert", "DLC_one.h5", "out.nc")
    assert code != 0 and "feeler tracks DLC_one.h5 --frame-rate" in said
    code, said = say("convert", "rec.csv", "out.nc")
    assert code != 0 and "feeler robot check rec.csv" in said


@pytest.mark.long
@pytest.mark.parametrize(
    ("start", "words"),
    [
        (b"SQLite format 3\0" + bytes(84), "no ROS recording that is whole"),
        (b"PK\x03\x04" + b"..[Content_Types].xml", "save a sheet of it as CSV"),
        (b"PK\x03\x04" + bytes(30), "ZIP archive"),
        (b"\0\0\0\x18ftypmp42" + bytes(30), "a film: track landmarks"),
        (b"\x89PNG\r\n" + bytes(30), "a picture"),
        (b"\x1f\x8b\x08\0" + bytes(30), "gunzip"),
        (b"\x80\x04" + bytes(30), "never read"),
        (b"ARROW1" + bytes(30), "by pandas"),
        (b'{"nbformat": 4}', "is JSON"),
        (b"version https://git-lfs.github.com/spec/v1", "git lfs pull"),
        (b"BZh91AY&SY" + bytes(30), "unpack it first"),
        (b" \n\n", "is empty"),
        ("scorer,a\nbodyparts,bä\n".encode("latin-1"), "is not UTF-8 text"),
        (b"\x07\0\x03" + bytes(30), "a kind that feeler does not know"),
    ],
)
def test_foreign_files_are_called_by_their_names(tmp_path, start, words):
    (tmp_path / "thing.dat").write_bytes(start)
    code, said = say("info", tmp_path / "thing.dat")
    assert code == 2 and words in said and "Traceback" not in said
    for verb in (("tracks",), ("robot", "check"), ("validate",)):
        code, said = say(*verb, tmp_path / "thing.dat")
        assert code != 0 and "Error" not in said.replace("UnicodeDecodeError", ""), said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("robot", "check", "DLC_one.h5"),
            "no recording of a robot. It is of another kind",
        ),
        (
            ("robot", "check", "surrogate_calibration_table.csv"),
            "feeler robot calibrate surrogate",
        ),
        (
            ("tracks", "mine.toml"),
            "no tracks. It is of another kind: robot (TOML). Next: feeler robot",
        ),
        (("tracks", "rec.csv"), "Next: feeler robot check rec.csv --antenna robot.toml"),
        (("convert", "objects.toml", "x.nc"), "--objects objects.toml discriminates them"),
        (("convert", "other.csv", "x.nc"), "holds no tensors. It is of another kind: a table"),
    ],
)
def test_a_verb_names_what_it_was_given_and_the_verb_that_takes_it(files, words, said):
    code, found = say(*words)
    assert code != 0 and said in found
    assert "Traceback" not in found and "damaged" not in found


@pytest.mark.parametrize("words", [("tracks",), ("robot", "check"), ("validate",), ("info",)])
def test_a_text_of_no_kind_is_refused_in_a_line_by_every_verb(files, words):
    Path("notes.md").write_text("# Notes\n\nThe left antenna was slower today.\n")
    code, found = say(*words, "notes.md")
    assert code != 0 and "notes.md is of a kind that feeler does not know" in found
    assert "Traceback" not in found
