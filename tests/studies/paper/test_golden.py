"""What the smoke run shows is what was kept: tables, numbers in sentences, values, figures."""

import pytest

from tests.golden import CLOSE, compare, read_kept

from . import _further
from ._golden import KEPT, TOLERANCES, write_golden

ROWS = [
    "| name | f [Hz] | share",
    "| stiff | 17.5 | 0.250 (0.2 to 0.3)",
    "| soft | 4.1e-03 | −3",
]


def test_the_smoke_run_shows_what_was_kept(whole):
    """A meant change is kept anew by ``make golden``, which prints this for review."""
    differences, _ = compare(read_kept(KEPT), write_golden(whole), TOLERANCES)
    assert not differences, "\n".join(
        [*differences, "meant? make golden, and look at the diff"]
    )


@pytest.mark.parametrize(
    ("was", "now"),
    [
        ("17.5", "35"),
        ("17.5", "4.1e-03"),
        ("17.5", f"{17.5 * (1 + 2 * CLOSE)}"),
        ("−3", "3"),
        ("[Hz]", "[kHz]"),
        ("stiff", "soft"),
        ("| soft | 4.1e-03", "| 4.1e-03 | soft"),
        ("0.2 to 0.3", "0.3 to 0.2"),
        ("f [Hz] | share", "share | f [Hz]"),
    ],
)
def test_a_wrong_cell_is_noticed(was, now):
    assert compare(ROWS, [row.replace(was, now, 1) for row in ROWS])[0]


def test_a_row_that_moved_or_is_missing_is_noticed_and_what_is_close_stays_as_it_was():
    assert compare(ROWS, [ROWS[0], ROWS[2], ROWS[1]])[0]
    assert compare(ROWS, ROWS[:2])[0] and compare(ROWS[:2], ROWS)[0]
    close = [row.replace("17.5", "17.505") for row in ROWS]
    assert compare(ROWS, close) == ([], ROWS)


@pytest.mark.long
def test_what_the_smoke_run_leaves_out_is_what_was_kept():
    differences, _ = compare(
        read_kept(_further.KEPT), _further.write_golden(), _further.TOLERANCES
    )
    assert not differences, "\n".join(
        [*differences, "meant? make golden, and look at the diff"]
    )
