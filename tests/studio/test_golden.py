"""What the studio's page shows is what was kept: its words, and what is drawn."""

import pytest

from feeler.studio import Studio
from tests.golden import compare, read_kept

from ._golden import KEPT, TOLERANCES, write_golden


@pytest.mark.long
def test_the_page_shows_what_was_kept(browser):
    """A meant change is kept anew by ``make golden``, which prints this for review."""
    running = Studio(port=0)
    try:
        found = write_golden(browser, running.address)
    finally:
        running.close()
    differences, _ = compare(read_kept(KEPT), found, TOLERANCES)
    assert not differences, "\n".join(
        [*differences, "meant? make golden, and look at the diff"]
    )
