"""Laws of a journal: what was added is found again, and foreign files stay as they are."""

import json

import numpy as np
import pytest

from feeler.errors import InvalidInput, StoreError
from feeler.provenance import Journal

KEY = "0123456789abcdef"
X = np.array([0.1, 1 / 3, -0.0])


def test_what_was_made_is_not_made_again(tmp_path):
    file = tmp_path / "journal"
    with Journal(file, KEY) as journal:
        made = journal.get_or(lambda: {"bits": np.float64(1 / 3), "rows": X}, "name", X, 3)
    with Journal(file, KEY) as journal:
        found = journal.get_or(lambda: pytest.fail("made again"), "name", X, 3)
        assert journal.find("name", X, 4) is None
        assert len(journal) == 1
    assert found == made == {"bits": 1 / 3, "rows": X.tolist()}
    assert np.signbit(found["rows"][2])


def test_without_a_path_it_is_kept_in_memory():
    journal = Journal()
    assert journal.get_or(lambda: 3, "a") == journal.get_or(lambda: 4, "a") == 3


def test_what_is_not_finite_comes_back(tmp_path):
    with Journal(tmp_path / "journal", KEY) as journal:
        found = journal.add([np.nan, np.inf, 1.0], "a")
    np.testing.assert_array_equal(np.array(found, dtype=float), [np.nan, np.inf, 1.0])


@pytest.mark.parametrize("cut", range(1, 60, 7))
def test_a_line_that_was_cut_is_dropped(tmp_path, cut):
    file = tmp_path / "journal"
    with Journal(file, KEY) as journal:
        for k in range(3):
            journal.add(k, X, k)
    whole = file.read_bytes()
    file.write_bytes(whole[:-cut])
    with Journal(file, KEY) as journal:
        for k in range(3):
            journal.get_or(lambda k=k: k, X, k)
    assert file.read_bytes() == whole


def test_an_empty_file_becomes_a_journal(tmp_path):
    Journal(tmp_path / "new", KEY).close()
    (tmp_path / "journal").touch()
    Journal(tmp_path / "journal", KEY).close()
    assert (tmp_path / "journal").read_bytes() == (tmp_path / "new").read_bytes() != b""


@pytest.mark.parametrize(
    "text",
    [
        b'{"key": "my secret api key"}',
        b'{"key": "my secret api key"}\n',
        b'{"key": "deadbeef"}',
        b'{"key": "0123456789abcdef0"}\n',
        b'{"key": "0123456789abcdef", "more": 1}\n',
        b'{"key":"0123456789abcdef"}\n',
        b"\n",
        b"notes\n",
        b"a" * 300,
        b'{"key": "0123456789abcdef"}\n{"x": 1}\n',
        b'{"key": "0123456789abcdef"}\n{"name": [1], "result": NaN}\n',
    ],
)
def test_a_foreign_file_is_refused_and_left_alone(tmp_path, text):
    file = tmp_path / "journal"
    file.write_bytes(text)
    with pytest.raises(InvalidInput, match="is no journal of a search"):
        Journal(file, KEY, "search")
    assert file.read_bytes() == text


def test_a_journal_of_something_else_is_refused_and_left_alone(tmp_path):
    file = tmp_path / "journal"
    Journal(file, KEY).close()
    before = file.read_bytes()
    with pytest.raises(
        InvalidInput, match="belongs to another search: settings or versions differ"
    ):
        Journal(file, "00", "search")
    assert file.read_bytes() == before
    with pytest.raises(InvalidInput, match="1 to 16 hexadecimal digits"):
        Journal(tmp_path / "new", "key")
    assert not (tmp_path / "new").exists()


def test_a_journal_has_one_writer(tmp_path):
    file = tmp_path / "journal"
    with (
        Journal(file, KEY),
        pytest.raises(StoreError, match="already open for writing in this process"),
    ):
        Journal(file, KEY)
    Journal(file, KEY).close()


class Full:
    """A file on a disk that takes no more than a few bytes."""

    def __init__(self, file, room):
        self.file, self.room = file, room

    def __getattr__(self, name):
        return getattr(self.file, name)

    def write(self, line):
        taken = line[: self.room]
        self.room -= len(taken)
        return self.file.write(taken)


def test_a_full_disk_leaves_whole_lines_only(tmp_path):
    file = tmp_path / "journal"
    with Journal(file, KEY) as journal:
        journal.add(1, "a")
        before, plain = file.read_bytes(), journal._file
        journal._file = Full(plain, room=10)
        words = (
            rf"cannot write 29 bytes to \S*journal, which holds {len(before)}: No space left on"
            r" device\. Free some space and run the same command again"
        )
        with pytest.raises(StoreError, match=words):
            journal.add(2, "b")
        assert file.read_bytes() == before
        journal._file = plain
        journal.add(3, "c")
    assert [json.loads(line)["name"] for line in file.read_bytes().splitlines()[1:]] == [
        ["a"],
        ["c"],
    ]
