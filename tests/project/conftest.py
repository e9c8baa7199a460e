"""What the laws share."""

import gc

import pytest


@pytest.fixture(autouse=True, scope="module")
def no_leftovers():
    """Collect what earlier tests left before sources are parsed.

    A failed task that zarr left behind is logged when it is collected; Python 3.11 parses code to
    print its traceback, and where that happens within another ``ast.parse`` the outer one ends with
    a SystemError (CPython issue 106905).
    """
    gc.collect()
