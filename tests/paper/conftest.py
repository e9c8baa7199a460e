"""One undisturbed run, shared by all tests that look at one."""

import pytest

from tests.paper_run import start


def pytest_collection_modifyitems(items):
    """The run takes a minute and more, so those who look at it are long tests."""
    for item in items:
        if "whole" in item.fixturenames and item.get_closest_marker("slow") is None:
            item.add_marker(pytest.mark.long)


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """An undisturbed run on one core; ``words.json`` beside it holds what was measured on the words
    of its figures.
    """
    out = tmp_path_factory.mktemp("whole") / "out"
    words = str(out.parent / "words.json")
    code = f"from tests.figures import reproduce_measured; reproduce_measured({words!r})"
    process = start(out, run=("-c", code))
    assert process.wait(600) == 0, process.stderr.read().decode()
    return out
