"""The API page shows every room, all that feeler offers, and all that the guide imports."""

import pkgutil
import re
from pathlib import Path
from types import ModuleType

import feeler

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
