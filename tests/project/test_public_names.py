"""Public names: what ``dir()`` shows, what old names say, and what the core does without."""

import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import feeler
from feeler import renamed

PACKAGES = [
    found.name
    for found in pkgutil.iter_modules(feeler.__path__)
    if found.ispkg and found.name not in ("cli", "experiments", "physics")
]


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_shows_its_public_names_only(name):
    package = importlib.import_module(f"feeler.{name}")
    assert dir(package) == sorted(package.__all__)
    assert all(hasattr(package, public) for public in package.__all__)


def test_every_public_name_of_feeler_can_be_fetched_and_no_other():
    assert all(getattr(feeler, name) is not None for name in dir(feeler))
    with pytest.raises(AttributeError, match=r"no attribute 'tuoch'; public names: .*touch"):
        _ = feeler.tuoch


@pytest.mark.parametrize(
    ("old", "name", "new"),
    [
        ("stimulus", "Ball", "objects"),
        ("stimulus.trial", "make_grid", "objects"),
        ("task", "Task", "objects"),
        ("dispersion", "compute_dispersion", "analysis"),
        ("information", "compute_information", "analysis"),
        ("response", "compute_strain", "analysis"),
    ],
)
def test_an_old_name_is_the_new_one_and_says_so(old, name, new):
    words = rf"feeler\.{old} is renamed: write `from feeler\.{new} import {name}`"
    with pytest.warns(DeprecationWarning, match=words):
        found = getattr(importlib.import_module(f"feeler.{old}"), name)
    assert found is getattr(importlib.import_module(f"feeler.{new}"), name)


@pytest.mark.parametrize("module", renamed.NAMES)
def test_an_old_name_in_a_package_is_the_new_one_and_says_so(module):
    home = importlib.import_module(module)
    for old, new in renamed.NAMES[module].items():
        with pytest.warns(
            DeprecationWarning, match=rf"{module}\.{old} is renamed: write {new}"
        ):
            assert getattr(home, old) is getattr(home, new)
    with pytest.raises(AttributeError, match="no attribute 'tuoch'"):
        _ = home.tuoch


@pytest.mark.long
def test_a_touch_loads_no_store_and_no_page():
    code = (
        "import sys; blocked = 'zarr numcodecs h5netcdf filelock safetensors mujoco'\n"
        "sys.modules.update(dict.fromkeys(blocked.split()))\n"
        "import feeler\n"
        "trial = feeler.Trial(feature=feeler.Ball(radius=1.0), location=0.5, speed=0.6)\n"
        "tensors = feeler.touch(feeler.presets.cockroach(), trial, duration=2.0)\n"
        "assert tensors.sizes['trial'] == 1\n"
        "slow = 'jinja2 matplotlib sklearn dask pint scipy.special scipy.linalg'\n"
        "print(*{*slow.split()} & {*sys.modules})\n"
    )
    for _ in range(2):  # the first may compile, which loads scipy
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


ROOT = Path(__file__).parents[2]


def list_reference() -> list[object]:
    """What the API page shows: each object it names, or all that a named module makes public."""
    shown = []

    def is_own(room: ModuleType, name: str) -> bool:
        return (
            not name.startswith("_")
            and getattr(getattr(room, name), "__module__", None) == room.__name__
        )

    for name in re.findall(
        r"^::: ([\w.]+)$", (ROOT / "docs" / "api.md").read_text(), re.MULTILINE
    ):
        thing = pkgutil.resolve_name(name)
        if isinstance(thing, ModuleType):
            public = getattr(
                thing, "__all__", [inner for inner in dir(thing) if is_own(thing, inner)]
            )
            shown += [getattr(thing, inner) for inner in public]
        else:
            shown.append(thing)
    return shown


def test_the_api_reference_shows_all_that_feeler_offers():
    offered = {name: getattr(feeler, name) for name in dir(feeler)}
    shown = list_reference()
    assert not [
        name
        for name, thing in offered.items()
        if not isinstance(thing, ModuleType) and thing not in shown
    ]
