"""What a result is identified by: feeler's version, its physics' version and the configuration."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from feeler import provenance
from feeler.errors import InvalidInput
from feeler.provenance import compute_digest, make_key, to_jsonable
from paper import context
from paper.context import Context
from paper.reproduce import STAGES


def list_keys() -> dict[str, str]:
    return {stage.name: stage.key(Context()) for stage in STAGES}


def find_changed(before: dict[str, str]) -> set[str]:
    return {name for name, key in list_keys().items() if key != before[name]}


def test_another_friction_changes_what_touches_alone(monkeypatch):
    before = list_keys()
    monkeypatch.setattr(context, "FRICTION", 0.5)
    assert find_changed(before) == {stage.name for stage in STAGES if "engine" in stage.reads}
    assert "tracking" not in find_changed(before)


def test_other_physics_and_another_release_are_another_key(monkeypatch):
    before = list_keys()
    monkeypatch.setattr(provenance, "PHYSICS", provenance.PHYSICS + 1)
    assert find_changed(before) == {*before}
    monkeypatch.undo()
    monkeypatch.setattr(provenance, "find_version", lambda name: "9.9.0")
    assert find_changed(before) == {*before}


def test_a_patch_release_and_other_packages_are_the_same_key(monkeypatch):
    real = provenance.find_version
    before = make_key({"a": 1})
    patched = ".".join([*real("feeler").split(".")[:2], "999"])
    versions = {"feeler": patched, "scikit-learn": "99.0"}
    monkeypatch.setattr(provenance, "find_version", lambda name: versions.get(name, real(name)))
    assert make_key({"a": 1}) == before


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
    assert to_jsonable(value) == plain


def test_what_has_no_plain_form_is_refused():
    with pytest.raises(
        InvalidInput, match="numbers, texts, lists and dictionaries; got object"
    ):
        compute_digest({"a": object()})


def test_order_does_not_matter():
    assert compute_digest({"a": 1, "b": np.array([2])}) == compute_digest({"b": [2], "a": 1})
