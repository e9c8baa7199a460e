"""The door for delimited text: what it reads, and that nothing else comes out of it than numbers or
our error.
"""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feeler.errors import InvalidInput
from feeler.tensors.table import parse_table, read_table


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
        ("a;b\n1;2,5\n", "Use a decimal point"),
        ("a,b\n1,__import__('os')\n", "is no finite number"),
    ],
)
def test_bad_tables(text, message):
    with pytest.raises(InvalidInput, match=message.replace("(", r"\(").replace(")", r"\)")):
        parse_table(text)


def test_unknown_column_lists_those_there_are():
    with pytest.raises(InvalidInput, match="no column 'c'; its columns are a, b"):
        parse_table("a,b\n1,2\n").column("c")


def test_files_that_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, message in [
        (tmp_path / "absent.csv", "No such file"),
        (tmp_path, "not a regular file"),
        (tmp_path / "pipe", "not a regular file"),  # would block for ever if it were opened
        ("a\0b", "cannot read"),
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


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=400))
def test_any_bytes_give_a_table_or_our_error(tmp_path_factory, raw):
    path = tmp_path_factory.mktemp("fuzz") / "t.csv"
    path.write_bytes(raw)
    try:
        table = read_table(path)
    except InvalidInput:
        return
    assert table.values.shape[1] == len(table.columns)
    assert not np.isinf(table.values).any()


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet='ab,;\t\n"#: 01.e-+_nN∞', max_size=120))
def test_any_text_gives_a_table_or_our_error(text):
    try:
        table = parse_table(text)
    except InvalidInput:
        return
    assert table.values.shape == (table.line.size, len(table.columns))
