"""What public things give, and how they refuse, is what was kept."""

import pytest

from tests.golden import compare, read_kept

from ._golden import KEPT, TOLERANCES, write_golden


@pytest.mark.long
def test_public_things_give_and_refuse_what_was_kept():
    """A meant change is kept anew by ``make golden``, which prints this for review."""
    differences, _ = compare(read_kept(KEPT), write_golden(), TOLERANCES)
    assert not differences, "\n".join(
        [*differences, "meant? make golden, and look at the diff"]
    )
