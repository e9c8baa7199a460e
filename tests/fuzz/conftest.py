"""Here the guard works in the process of the test: a process for each of thousands of inputs would
take hours.
"""

import pytest


@pytest.fixture(autouse=True)
def in_process(guard_in_process):
    """For every test of this folder that does not say otherwise."""
