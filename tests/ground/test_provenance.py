"""What a result depends on is found in the code: a change reaches the keys that it must reach, and
no others.
"""

import ast
import os
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from feeler import provenance
from feeler import provenance as sources
from feeler.errors import InvalidInput, StoreError
from feeler.provenance import (
    compute_digest,
    describe_code,
    find_data,
    find_modules,
    make_key,
    make_plain,
    parse_module,
    resolve,
)
from feeler.studies.paper.context import Context
from feeler.studies.paper.kept import fingerprint
from feeler.studies.paper.reproduce import STAGES
from feeler.tracking import read_table

pytestmark = pytest.mark.long

FILES = sorted(sources.SOURCE.rglob("*.py"))[::6]
TRACKING = "feeler.studies.paper.figS2"


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("copy") / "feeler"
    return shutil.copytree(sources.SOURCE, folder, ignore=shutil.ignore_patterns("__pycache__"))


@pytest.fixture
def copied(copy, monkeypatch):
    """A copy of feeler's source, which a test may change; what is fingerprinted is the copy."""
    monkeypatch.setattr(sources, "SOURCE", copy)
    monkeypatch.setattr(
        provenance, "_LOADED", provenance.tick() + 3600
    )  # as if Python were started after each change
    return copy


def list_keys() -> dict[str, str]:
    return {stage.name: stage.key(Context()) for stage in STAGES}


def find_changed(path: Path, old: str, new: str) -> set[str]:
    """Stages whose key a change of one file changes."""
    before, text = list_keys(), path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    changed = {name for name, key in list_keys().items() if key != before[name]}
    path.write_text(text)
    assert list_keys() == before
    return changed


def find_copy(copied: Path, module: str) -> Path:
    return copied.joinpath(*module.split(".")[1:]).with_suffix(".py")


def test_a_constant_of_the_csv_reader_changes_the_stages_that_read_recordings(copied):
    path = find_copy(copied, read_table.__module__)
    assert find_changed(path, "MAX_BYTES = ", "MAX_BYTES = 1 + ") == {
        "robot",
        "tracking",
        "tensors",
    }


def test_a_constant_of_a_drawing_changes_that_stage_alone(copied):
    assert find_changed(
        copied / "studies" / "paper" / "figS2.py", "def plot(", "COLOUR = 3\n\n\ndef plot("
    ) == {"tracking"}


def test_a_constant_of_the_compiler_wrapper_changes_all_that_run_compiled_code(copied):
    running = {
        stage.name for stage in STAGES if "feeler.compiled" in find_modules(*stage.modules)
    }
    assert {"calibration", "tensors", "wall", "encoding", "reading", "cnn", "robot"} <= running
    assert find_changed(copied / "compiled.py", "nogil=True", "nogil=False") == running


def test_targets_change_the_stage_that_reads_them(copied):
    path = copied / "calibration" / "data" / "cockroach.toml"
    assert find_changed(path, "value = ", "value = 1") == {"calibration"}


@pytest.mark.parametrize(
    ("file", "stage"),
    [
        ("paper/open_design.json", "design"),
        pytest.param("paper/open_receptor.json", "receptor", marks=pytest.mark.long),
        pytest.param("paper/open_unseen.json", "unseen", marks=pytest.mark.long),
        pytest.param("spiking/measured.json", "spikes", marks=pytest.mark.long),
        ("contests/measured.json", "tradeoff"),
    ],
)
def test_a_kept_result_changes_the_section_that_shows_it_alone(copied, file, stage):
    fingerprints = {one.name: fingerprint(one) for one in STAGES}
    path = copied / "studies" / file
    assert find_changed(path, "{", "{ ") == {stage}
    path.write_text(path.read_text() + "\n")
    changed = {one.name for one in STAGES if fingerprint(one) != fingerprints[one.name]}
    path.write_text(path.read_text()[:-1])
    assert changed == {stage}


def test_every_data_file_of_the_studies_is_in_a_key():
    read = {path for stage in STAGES for path in find_data(find_modules(*stage.modules))}
    told = {
        "findings.toml",
        "statements.toml",
        "story.toml",
        "places.toml",
    }  # words of the page
    asked = {"open_unseen.toml"}  # of benchmarks/questions.py, whose answer the section reads
    folder = sources.SOURCE / "studies"
    held = {path for path in (*folder.glob("*/*.json"), *folder.glob("*/*.toml"))}
    assert {path.name for path in held - read} == told | asked


def test_a_word_changes_no_key(copied):
    before = list_keys()
    for path in copied.rglob("*.py"):
        path.write_text(path.read_text() + '\n\n\n# a word\n"""A word."""\n')
    assert list_keys() == before


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(sources.SOURCE)))
def test_form_and_documentation_do_not_count(path, tmp_path):
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module) and ast.get_docstring(
            node
        ):
            node.body[0].value.value = "Other words."
    other = tmp_path / path.name
    other.write_text(ast.unparse(tree))  # without comments, in another layout
    assert parse_module("m", other).digest == parse_module("m", path).digest


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("x = 1", "x = 2"),
        ("x = 1", "y = 1"),
        ("def f(a=1): ...", "def f(a=2): ..."),
        ("a = b < c", "a = b <= c"),
        ('f("text")', 'f("other")'),
        ("import a", "import b"),
        ("@one\ndef f(): ...", "@two\ndef f(): ..."),
    ],
)
def test_what_is_done_counts(tmp_path, old, new):
    (tmp_path / "old.py").write_text(old)
    (tmp_path / "new.py").write_text(new)
    assert (
        parse_module("m", tmp_path / "old.py").digest
        != parse_module("m", tmp_path / "new.py").digest
    )


@pytest.mark.parametrize(
    ("module", "name", "home"),
    [
        ("feeler.tensors", "make_tensors", "feeler.tensors.schema"),
        ("feeler", "touch", "feeler.experiments.tactile"),
        ("feeler", "presets", "feeler.presets"),
        ("feeler.physics", "clock", "feeler.physics.scene"),
        ("feeler.errors", "InvalidInput", "feeler.errors"),
        ("feeler.tensors.formats", None, "feeler.tensors.formats"),
        ("math", "pi", "math"),
    ],
)
def test_a_name_leads_to_the_file_that_defines_it(module, name, home):
    assert resolve(module, name) == home


def test_no_stage_depends_on_a_room_as_a_whole():
    for stage in STAGES:
        rooms = [
            name
            for name, module in find_modules(*stage.modules).items()
            if module.path.endswith("__init__.py")
        ]
        assert rooms == [], stage.name


def test_a_room_only_hands_names_on():
    """What stands in ``__init__`` is in no key, so nothing that computes may stand there."""
    allowed = (ast.Import, ast.ImportFrom, ast.If, ast.Expr, ast.Assign)
    for path in sources.SOURCE.glob("*/**/__init__.py"):
        for line in ast.parse(path.read_text()).body:
            assert isinstance(line, allowed) or getattr(line, "name", "") in (
                "__getattr__",
                "__dir__",
            ), path


def test_an_open_set_is_filled_where_it_stands_or_by_homes():
    """What another module of feeler added when imported would be in no key of what only reads the
    set.
    """
    for path in sources.SOURCE.rglob("*.py"):
        tree = ast.parse(path.read_text())
        imported = {
            alias.asname or alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        filled = {
            node.value.id
            for node in ast.walk(tree)
            if isinstance(node, ast.Attribute)
            and node.attr == "register"
            and isinstance(node.value, ast.Name)
        }
        assert not filled & imported, path


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)


def test_every_way_to_import_is_followed_but_those_for_types(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(provenance, "_LOADED", provenance.tick() + 3600)
    write(
        tmp_path,
        start=(
            "from typing import TYPE_CHECKING\nimport one\nENGINES = {'new': 'home.of:engine'}\nif"
            " TYPE_CHECKING:\n    import never\n\ndef f():\n    from two import x\n    import"
            " scipy.special\n"
        ),
        one="import three",
        two="x = 1",
        three="",
        never="",
    )
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "__init__.py").touch()
    write(tmp_path / "home", of="engine = 1")
    found = find_modules("start", "home.of")
    assert set(found) == {"start", "one", "two", "three", "home.of"}
    assert describe_code("start")["scipy"]


def test_an_entry_of_an_open_set_is_followed():
    assert {"feeler.physics.mujoco", "feeler.physics.chain.stepper"} <= set(
        find_modules("feeler.physics.engine")
    )


def test_code_from_outside_counts(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(provenance, "_LOADED", provenance.tick() + 3600)
    write(tmp_path, my_shape="from my_numbers import WIDTH", my_numbers="WIDTH = 1")
    before = make_key({}, "my_shape")
    assert make_key({}, "my_shape") == before
    write(tmp_path, my_numbers="WIDTH = 25")
    assert make_key({}, "my_shape") != before
    assert make_key({}, "typed.at.a.prompt") == make_key({})


def test_another_version_is_another_key(monkeypatch):
    before = list_keys()
    monkeypatch.setattr(provenance, "list_versions", lambda: {"numpy": "0.0"})
    assert not set(before.values()) & set(list_keys().values())


def test_a_package_counts_where_it_is_used(monkeypatch):
    before = list_keys()
    real = provenance.find_version
    monkeypatch.setattr(
        provenance, "find_version", lambda name: "0.0" if name == "torch" else real(name)
    )
    # whoever may ask any reader by its name may ask the network
    reading = {"cnn", "reading", "robot", "tradeoff", "gradient", "bounds", "design"}
    reading |= {"axes", "receptor"}
    assert {name for name, key in list_keys().items() if key != before[name]} == reading


def test_code_that_changed_while_it_ran_is_refused(copied, monkeypatch):
    path = find_copy(copied, read_table.__module__)
    monkeypatch.setattr(provenance, "_LOADED", provenance.tick() - 60)
    for file in copied.rglob("*"):
        os.utime(file, (0, 0))
    describe_code(TRACKING)
    path.touch()
    with pytest.raises(
        StoreError,
        match=rf"changed while it was running \(tensors/{path.name}\).*Start Python again",
    ):
        describe_code(TRACKING)


@pytest.mark.parametrize(
    "days", [-1, 3650, *(pytest.param(days, marks=pytest.mark.long) for days in (-3650, 1))]
)
def test_a_clock_that_is_set_changes_no_code_and_hides_no_change(copied, monkeypatch, days):
    """As on a robot without a clock, whose time is right only after a while."""
    began = time.time() - 60
    now = time.time() + 86400 * days
    made = now - 120 if days < 0 else began + 43200 * days
    monkeypatch.setattr(provenance, "_LOADED", provenance.tick() - 60)
    monkeypatch.setattr(provenance.time, "time", lambda: now)
    for file in copied.rglob("*"):
        os.utime(file, (0, made))
    describe_code(TRACKING)
    os.utime(find_copy(copied, read_table.__module__), (0, now - 1))
    with pytest.raises(StoreError, match="changed while it was running"):
        describe_code(TRACKING)


def test_notes_of_what_was_read_are_only_a_memory(copied):
    fresh = describe_code(TRACKING)
    sources._write_notes(copied / "notes.json", sources._open_notes(copied))
    reader = sources.compute_hash(Path(sources.__file__).read_bytes())[:8]
    tag = sources.sys.implementation.cache_tag
    notes = copied / "__pycache__" / f"sources-{tag}-{reader}.json"
    notes.parent.mkdir(exist_ok=True)
    (copied / "notes.json").replace(notes)
    sources._open_notes.cache_clear()
    assert describe_code(TRACKING) == fresh
    for damaged in ("{broken", "[]", "null", '"text"', "[" * 100_000, '{"feeler": [1, 2, 3]}'):
        notes.write_text(damaged)
        sources._open_notes.cache_clear()
        assert describe_code(TRACKING) == fresh


def test_data_with_a_name_filled_in_counts():
    found = find_data(find_modules("feeler.calibration.problem"))
    assert [path.name for path in found] == ["cockroach.toml"]


@dataclass
class Thing:
    size: float
    parts: tuple


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (np.arange(3.0), [0.0, 1.0, 2.0]),
        (Thing(np.float32(0.5), (1, "a")), {"size": 0.5, "parts": [1, "a"]}),
        ({1: Path("a")}, {"1": "a"}),
        ([float("inf"), float("nan"), None, True], ["inf", "nan", None, True]),
    ],
)
def test_plain_data(value, plain):
    assert make_plain(value) == plain


def test_what_has_no_plain_form_is_refused():
    with pytest.raises(
        InvalidInput, match="numbers, texts, lists and dictionaries; got object"
    ):
        compute_digest({"a": object()})


def test_order_does_not_matter():
    assert compute_digest({"a": 1, "b": np.array([2])}) == compute_digest({"b": [2], "a": 1})
