"""Files are whole or as they were; what killed processes leave goes; who gets no lock is told."""

import os
import time

import filelock
import pytest

from feeler import files
from feeler.errors import InvalidInput, StoreError
from feeler.files import Lock, sweep_old, temporary_folder, writing


def write(path, text="new"):
    with writing(path) as part:
        part.write_text(text)


def test_a_file_is_whole_or_as_it_was(tmp_path):
    path = tmp_path / "a.csv"
    write(path, "old")
    with pytest.raises(RuntimeError), writing(path) as part:
        part.write_text("ne")
        raise RuntimeError
    assert path.read_text() == "old"
    write(path)
    assert path.read_text() == "new"
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("name", ["folder", "none/a.csv", "file/a.csv", ".", "a" * 256, "pipe"])
def test_what_can_be_no_file_is_named(tmp_path, name):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InvalidInput, match=r"cannot write .*Name a file in a folder"):
        write(tmp_path / name)
    assert len([*tmp_path.iterdir()]) == 3


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs Linux")
def test_a_full_disk_is_told_with_file_and_size(tmp_path):
    def fill():
        with writing(tmp_path / "a.csv") as part:
            part.write_text("123")
            with open("/dev/full", "w") as full:
                full.write("4")

    with pytest.raises(
        StoreError, match=r"no room left for .*a\.csv, of which 3 bytes .* Free"
    ):
        fill()
    assert [*tmp_path.iterdir()] == []


def age(path, days):
    then = time.time() - days * 24 * 3600
    os.utime(path, (then, then))


def test_the_oldest_go_and_the_young_and_the_newest_stay(tmp_path):
    for days in (1, 5, 8, 11):
        (tmp_path / f"a{days}").mkdir() if days % 2 else (tmp_path / f"a{days}").touch()
        age(tmp_path / f"a{days}", days)
    sweep_old(tmp_path, "a*", keep=1, days=6)
    assert {path.name for path in tmp_path.iterdir()} == {"a1", "a5"}
    sweep_old(tmp_path, "a*", keep=1)
    assert {path.name for path in tmp_path.iterdir()} == {"a1"}


def test_folders_of_killed_processes_go_after_a_week(tmp_path, monkeypatch):
    monkeypatch.setattr(files.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(files.tempfile, "tempdir", str(tmp_path))
    for name, days in (("feeler-once-old", 8), ("feeler-once-new", 1), ("other", 8)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").touch()
        age(tmp_path / name, days)
    with temporary_folder() as folder:
        assert folder.parent == tmp_path
    assert {path.name for path in tmp_path.iterdir()} == {"feeler-once-new", "other"}


@pytest.mark.parametrize("place", ["file/.lock", "none/deep/.lock"])
def test_where_no_lock_can_be_had_it_says_so(tmp_path, place):
    (tmp_path / "file").touch()
    (tmp_path / "none").touch()
    with pytest.raises(StoreError, match=r"the set cannot be locked against other writers \("):
        Lock(tmp_path / place, "the set")


def test_a_file_system_without_locks_is_named(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(37, "No locks available")

    monkeypatch.setattr(filelock.FileLock, "acquire", refuse)
    with pytest.raises(StoreError, match=r"\(No locks available\)\. Use a folder"):
        Lock(tmp_path / ".lock", "the set")
