"""One undisturbed run, shared by all tests that look at one."""

import pytest

from ._run import start


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """An undisturbed run on one core."""
    out = tmp_path_factory.mktemp("whole") / "out"
    process = start(out, "--workers", "1")
    assert process.wait(600) == 0, process.stderr.read().decode()
    return out
