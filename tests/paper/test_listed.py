"""Every testable sentence of the paper has its claims, or a word why there is none."""

from paper.claims import load_claims
from paper.declared import read_declared

STATEMENTS = read_declared("statements.toml")["statement"]
CITED = {"step-rejected"}
"""Claims that the paper does not make."""


def test_a_statement_has_claims_or_says_why_not():
    for one in STATEMENTS:
        assert set(one) in ({"where", "says", "claims"}, {"where", "says", "why"}), one["says"]
        assert one.get("claims") or one.get("why"), one["says"]
    assert len({one["says"] for one in STATEMENTS}) == len(STATEMENTS)


def test_every_claim_of_the_paper_stands_under_a_statement():
    listed = {claim for one in STATEMENTS for claim in one.get("claims", ())}
    assert listed == {claim.id for claim in load_claims() if claim.whose == "paper"} - CITED
