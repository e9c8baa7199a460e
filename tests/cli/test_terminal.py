"""What names of files, columns and topics hold reaches no terminal as what it would obey."""

import contextlib
import io
import re
import sys

import numpy as np
import pytest

from feeler.cli.app import main
from feeler.errors import _PlainStream, escape
from feeler.robot.description import get_example

OSC, CLEAR, CLIP = "\x1b]0;PWNED\x07", "\x1b[2J\x1b[31m", "\x1b]52;c;cm0=\x07"
NAMES = [
    OSC,
    CLEAR,
    CLIP,
    "\x9b2J",
    "\x08\x7f\r",
    "\u202egpj",
    "\u2066x\u2069",
    "a\nfeeler: all well\n",
]
RAW = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


@pytest.fixture
def call(monkeypatch, capfd, tmp_path):
    """What a command writes to standard output and error, in a folder of its own."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["feeler", *map(str, words)])
        with contextlib.suppress(SystemExit):
            main()
        return "".join(capfd.readouterr())

    return call


@pytest.mark.parametrize("name", NAMES)
def test_a_text_is_shown_with_what_a_terminal_obeys_written_out(name):
    shown = escape(f"a {name} b")
    assert shown.isprintable() and escape(shown) == shown
    assert escape("°µ–“é漢字") == "°µ–“é漢字"
    assert escape("a\n\tb", lines=True) == "a\n\tb"
    with pytest.raises(UnicodeEncodeError):
        "\udc9b".encode()
    assert escape("\udc9b") == r"\udc9b"


def test_a_line_that_is_written_anew_still_is(capsys):
    stream = _PlainStream(sys.stdout)
    for text in ("\r12 antennas", "\r", "\n", "a\rb"):
        stream.write(text)
    assert capsys.readouterr().out == "\r12 antennas\r\na\\rb"
    print("name\x07", file=stream)
    assert capsys.readouterr().out == "name\\x07\n" and not stream.isatty()


@pytest.mark.long
def test_no_command_hands_on_what_a_name_says_to_the_terminal(call, tmp_path):
    """In errors and in success."""
    name = "".join(NAMES[:-1])
    toml = f"b{name}.toml"
    table = f"t{name}.csv"
    made = f"m{name}.toml"
    release = f"r{name}.csv"
    (tmp_path / toml).write_text("x = 1\n")
    (tmp_path / table).write_text("time_ms,hinge1_deg\n0,1\n1,2\n")
    (tmp_path / release).write_bytes(get_example("release").read_bytes())
    for words in (
        ("info", toml),
        ("info", f"absent{name}"),
        ("info", release),
        ("validate", toml),
        ("validate", release),
        ("robot", "new", made),
        ("robot", "new", made),
        ("robot", "check", table),
        ("robot", "check", release),
        ("robot", "example", f"o{name}"),
        ("robot", "board", f"b{name}.ino"),
        ("robot", "calibrate", toml),
        ("robot", "convert", release, "--out", f"c{name}.nc"),
        ("info", f"c{name}.nc"),
        ("convert", f"c{name}.nc", f"d{name}.csv"),
        ("tracks", table, "--frame-rate", "100"),
        ("touch", "--antenna", toml),
        ("touch", name),
        (f".{name}",),
        ("design", f"p{name}.toml", "--new"),
        ("antenna", "exponential", f"a{name}.toml"),
    ):
        said = call(*words)
        assert said and not RAW.findall(said), ascii(said)
    assert (tmp_path / f"c{name}.nc").exists()


@pytest.mark.parametrize("name", ["".join(NAMES[:-1]), NAMES[-1]])
def test_names_within_a_file_are_shown_so_too(name, call, tmp_path):
    xarray = pytest.importorskip("xarray")
    column = name.replace("\n", "")
    (tmp_path / "t.csv").write_text(f"time_ms,hinge1_deg,{column}\n0,1,2\n1,2,3\n")
    data = xarray.Dataset({name: (("row",), np.arange(3.0))}, attrs={"title": name})
    data.to_netcdf(tmp_path / "x.nc", engine="h5netcdf")
    for words in (("info", "t.csv"), ("robot", "check", "t.csv"), ("info", "x.nc")):
        said = call(*words)
        assert said and not RAW.findall(said), ascii(said)


def test_signs_that_the_terminal_has_not_end_no_command(monkeypatch):
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", None)  # closed, as services start what they run
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(sys, "argv", ["feeler", "touch", "--location", "7"])
    with pytest.raises(SystemExit, match="2"):
        main()
    stream.flush()
    assert b"--location must be > 0 and \\u2264 1" in stream.buffer.getvalue()
