"""What is not borne out says why, and what would; what is borne out does not speak of it."""

import pytest

from paper.claims import load_claims

HAVE = [claim for claim in load_claims() if claim.unmet]


@pytest.mark.parametrize("claim", HAVE, ids=lambda claim: claim.id)
def test_it_is_a_paragraph_of_a_claim_that_can_fail(claim):
    assert claim.standing == "evidence"
    assert claim.kind != "none"
    assert claim.unmet.endswith(".")


def test_every_claim_of_the_wall_and_the_network_is_ready_to_fail():
    asked = {
        c.id
        for c in load_claims()
        if c.due == "paper" and c.whose == "paper" and c.standing == "evidence"
    }
    assert asked <= {claim.id for claim in HAVE}
