"""The door for delimited text: what it reads, and that nothing else comes out of it than numbers or
our error.
"""

import os

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.files import read_start
from feeler.tables import find_times, parse_table, read_table, sniff_columns


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_delimiters_notes_and_missing_cells(tmp_path, delimiter):
    rows = [
        "# Rate: 1000 Hz",
        "# source: synthetic",
        '"a" b'.replace(" ", delimiter),
        "1 ".replace(" ", delimiter),
    ]
    rows += ["NaN 2.5e-1".replace(" ", delimiter), ""]
    path = tmp_path / "t.csv"
    path.write_bytes(
        b"\xef\xbb\xbf" + "\r\n".join(rows).encode()
    )  # byte-order mark and Windows line ends
    table = read_table(path)
    assert table.columns == ("a", "b")
    assert table.notes == {"rate": "1000 Hz", "source": "synthetic"}
    np.testing.assert_array_equal(table.values, [[1.0, np.nan], [np.nan, 0.25]])
    np.testing.assert_array_equal(table.line, [4, 5])


@pytest.mark.parametrize("coding", ["utf-16", "utf-8-sig", "utf-8"])
def test_unicode_text_and_broken_headers_of_spreadsheets(tmp_path, coding):
    path = tmp_path / "t.txt"
    path.write_bytes('"force\r\n(µN)"\t"a"\r\n1,5\t2\r\n\t-3,25\r\n'.encode(coding))
    table = read_table(path)
    assert table.columns == ("force (µN)", "a")
    assert sniff_columns(read_start(path, 4096)) == ["force (µN)", "a"]
    np.testing.assert_array_equal(table.values, [[1.5, 2.0], [np.nan, -3.25]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no header row"),
        ("# only: notes\n", "no header row"),
        ("1,2\n3,4\n", "must name every column"),
        ("a,a\n1,2\n", "two columns are called 'a'"),
        ("a,,c\n1,2,3\n", "must name every column"),
        ("a,b\n1\n", "line 2: 1 cells where the header has 2"),
        ("a,b\n1,2,3\n", "line 2: 3 cells"),
        ("a,b\n1,two\n", "line 2, column 'b': 'two' is no finite number"),
        ("a,b\n1,inf\n", "'inf' is no finite number"),
        ("a,b\n1,1e999\n", "'1e999' is no finite number"),
        ("a,b\n1,1_0\n", "'1_0' is no finite number"),
        ("a;b\n1;2,5\n3.5;1\n", "line 2: '2,5' has a decimal comma, '3.5' a decimal point"),
        ("a;b\n1;2,500\n1;-12,125\n", "is '2,500' a decimal, or are these thousands"),
        ("a;b\n1;900\n1;1.026\n", "is '1.026' a decimal, or are these thousands"),
        ('a,b\n1,2\n1,"2,5"\n', "Use a decimal point"),
        ("a,b\n1,__import__('os')\n", "is no finite number"),
    ],
)
def test_bad_tables(text, message):
    with pytest.raises(InvalidInput, match=message.replace("(", r"\(").replace(")", r"\)")):
        parse_table(text)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_row_of_empty_cells_is_a_row_and_a_blank_line_is_none(delimiter):
    text = "a,b\n1,2.125\n,\n\n3,4.5\n".replace(",", delimiter)
    expected = [[1.0, 2.125], [np.nan, np.nan], [3.0, 4.5]]
    np.testing.assert_array_equal(parse_table(text).values, expected)
    threes = "a,b\n100,2.125\n101,3.500\n".replace(",", delimiter)  # decimals, all with a point
    np.testing.assert_array_equal(parse_table(threes).values, [[100, 2.125], [101, 3.5]])


def test_unknown_column_lists_those_there_are():
    with pytest.raises(InvalidInput, match="no column 'c'; its columns are a, b"):
        parse_table("a,b\n1,2\n").column("c")


def test_files_that_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in [
        (tmp_path / "absent.csv", "no such file"),
        (tmp_path, "not a regular file"),
        (tmp_path / "pipe", "not a regular file"),  # would block for ever if it were opened
        ("a\0b", "a path that a file can have"),
    ]:
        with pytest.raises(InvalidInput, match=message):
            read_table(path)


def test_binary_and_oversized_files(tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(b"a,b\n1,\xff\n")
    with pytest.raises(InvalidInput, match="not UTF-8 text"):
        read_table(path)
    path.write_bytes(b"a,b\n1,\0\n")
    with pytest.raises(InvalidInput, match="binary file"):
        read_table(path)
    path.write_bytes(b"a,b\n" + b"1,2\n" * 100)
    with pytest.raises(InvalidInput, match="over the limit of 50"):
        read_table(path, max_bytes=50)
    with pytest.raises(InvalidInput, match="exceed 100 cells"):
        read_table(path, max_cells=100)


@pytest.mark.parametrize(
    ("text", "columns", "values"),
    [
        ("a;b\n0,5;1,25e2\n;-,5\n", ("a", "b"), [[0.5, 125], [np.nan, -0.5]]),
        ("a\tb\n1\t0,125\n2\t1,125\n", ("a", "b"), [[1, 0.125], [2, 1.125]]),
        ("a b\n0,5   7\n1,5 8\n", ("a", "b"), [[0.5, 7], [1.5, 8]]),
        ("t;h (mV)\n(ms);\n1;2\n", ("t (ms)", "h (mV)"), [[1, 2]]),
        ("a,b\nms,deg\n1,2\n", ("a (ms)", "b (deg)"), [[1, 2]]),
        ("Logger 3000\nDate: 3 May\n\na,b\n1,2\n", ("a", "b"), [[1, 2]]),
        ("# source: robot\n# a b\n1 2\n3 4\n", ("a", "b"), [[1, 2], [3, 4]]),
        ('"a, of two",b\n1,2\n', ("a, of two", "b"), [[1, 2]]),
        ("%time,b\n1,2\n", ("%time", "b"), [[1, 2]]),
        ("f,tip,,a\n,x,y,x\n0,1,2,3\n", ("f", "tip_x", "tip_y", "a_x"), [[0, 1, 2, 3]]),
        ("time_ms,b\nms,µN\n1,2\n", ("time_ms", "b (µN)"), [[1, 2]]),
        ("a,b,,\n1,2,,\n", ("a", "b"), [[1, 2]]),
        ("a,b\n#N/A,1\n.,n/a\n", ("a", "b"), [[np.nan, 1], [np.nan, np.nan]]),
        ("t (s);x, px;y, px\n1;0,5;2\n", ("t (s)", "x, px", "y, px"), [[1, 0.5, 2]]),
        ("Unnamed: 0,time,b\n0,1,2\n", ("row", "time", "b"), [[0, 1, 2]]),
        ("sep=;\na;b\n1;2\n", ("a", "b"), [[1, 2]]),
    ],
    ids=[
        "commas",
        "tabs",
        "blanks",
        "units",
        "bare units",
        "logger",
        "savetxt",
        "quotes",
        "ros",
        "two rows of names",
        "units twice",
        "trailing delimiters",
        "missing in words",
        "commas in names",
        "pandas' index",
        "Excel's sep",
    ],
)
def test_tables_as_laboratories_write_them(text, columns, values):
    table = parse_table(text)
    assert table.columns == columns
    np.testing.assert_array_equal(table.values, values)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time_ms", "ms"),
        ("Time (s)", "s"),
        ("Elapsed Time [us]", "us"),
        ("time, s", "s"),
        ("timestamp", ""),
        ("seconds", "seconds"),
        ("__time", "s"),
        ("times", ""),
        ("ts", None),
        ("time_min", None),
        ("s", None),
    ],
)
def test_a_column_of_times_is_known_by_its_name_and_says_its_unit(name, unit):
    assert find_times(["a", name]) == ({} if unit is None else {name: unit})
    assert find_times(["onset_s", "on", "off"], "onset|on") == {"onset_s": "s", "on": ""}


def test_a_table_of_words_keeps_its_first_line_as_names():
    table = parse_table("file,animal,group\nu,a,x\nv,2,y\n", words=("file", "group"))
    assert {name: texts.tolist() for name, texts in table.words.items()} == {
        "file": ["u", "v"],
        "animal": ["a", "2"],
        "group": ["x", "y"],
    }


def test_lines_above_the_header_are_notes():
    table = parse_table("Logger;3000\nrobot: A\nt;b\n1;0,5\n")
    assert table.notes == {"logger": "3000", "robot": "A", "decimals": "commas"}


def test_columns_of_words_are_left_out_where_that_is_asked_for():
    text = "a,who,b\n1,,2\n3,ok,4\n5,7,6\n"
    with pytest.raises(InvalidInput, match="line 3, column 'who': 'ok' is no finite number"):
        parse_table(text)
    table = parse_table(text, words=True)
    assert [*table.words] == ["who"] and table.words["who"].tolist() == ["", "ok", "7"]
    np.testing.assert_array_equal(
        table.values, [[1, np.nan, 2], [3, np.nan, 4], [5, np.nan, 6]]
    )
    with pytest.raises(
        InvalidInput, match=r"column 'who' holds text .'ok'., numbers are needed"
    ):
        table.column("who")
    with pytest.raises(InvalidInput, match="line 4, column 'b': 'bad' is no finite number"):
        parse_table("a,who,b\n1,,2\n3,ok,4\n5,7,bad\n", words=True)
