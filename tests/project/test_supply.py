"""What is installed with feeler has a licence in NOTICE.md and a version in constraints.txt."""

import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OURS = {"test", "check", "docs", "lab", "bench", "audit"}
"""Extras for those who work on feeler."""
EXTRAS = PROJECT["optional-dependencies"]


def list_names(lines):
    """Packages that are named, without feeler's own extras."""
    return {canonicalize_name(Requirement(line).name) for line in lines} - {"feeler"}


CORE = list_names(PROJECT["dependencies"])
USED = CORE | set().union(*(list_names(EXTRAS[name]) for name in {*EXTRAS} - OURS))


def list_installed(names):
    """These packages and all that they need, as far as they are installed here."""
    todo, found = [*names], {}
    while todo:
        name = todo.pop()
        if name in found:
            continue
        try:
            found[name] = metadata.distribution(name)
        except metadata.PackageNotFoundError:
            continue
        for line in found[name].requires or ():
            need = Requirement(line)
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                todo.append(canonicalize_name(need.name))
    return found


@pytest.mark.parametrize("package", sorted(USED))
def test_what_users_install_has_its_licence(package):
    rows = [
        line for line in (ROOT / "NOTICE.md").read_text().splitlines() if line.startswith("| ")
    ]
    assert [row for row in rows if canonicalize_name(row.split("|")[1].strip()) == package]


def test_licences_that_ask_for_more_are_named():
    """LGPL and GPL, as the packages state them."""
    text = (ROOT / "NOTICE.md").read_text().lower()
    strict = {
        name
        for name, package in list_installed(USED).items()
        if any("GPL" in line for line in package.metadata.get_all("Classifier") or ())
        or "GPL" in (package.metadata.get("License-Expression") or "")
    }
    assert {name for name in strict if f"**{name}**" not in text} == set()
