"""Every sentence of the paper that could be tested has its claim, or a reason why there is none;
and every claim of the paper has its sentence.
"""

import pytest

from feeler.studies.paper.claims import load_claims, load_sentences

CLAIMS = {claim.id: claim for claim in load_claims() if claim.whose == "paper"}


@pytest.mark.parametrize("sentence", load_sentences(), ids=lambda one: one["says"][:40])
def test_a_sentence_has_claims_or_a_reason(sentence):
    assert {*sentence} in ({"where", "says", "claims"}, {"where", "says", "why"})
    assert sentence.get("claims") or sentence["why"]
    assert {*sentence.get("claims", ())} <= {*CLAIMS}


def test_a_claim_of_the_paper_has_a_sentence_in_it():
    named = {name for sentence in load_sentences() for name in sentence.get("claims", ())}
    cited = {name for name, claim in CLAIMS.items() if claim.tag == "B"}
    assert {*CLAIMS} - named == cited
