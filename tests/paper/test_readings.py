"""Readings of the paper's sentences: the rule of agreement, the verdicts, the derived line, and the
shortcut by which LDA is computed.
"""

import numpy as np
import pandas as pd
import pytest
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

from feeler.encoding import hoyer_sparseness
from feeler.errors import InvalidInput
from paper import readings, readings_computed
from paper.readings import (
    COLUMNS,
    NATURAL,
    WORDS,
    Option,
    Sentence,
    agree,
    decide,
    find_rule,
    judge_sentences,
    load_sentences,
    make_rows,
    measure_effect,
)
from paper.readings_computed import (
    classify_projected,
    compute_gini,
    fit_components,
    scale_noise,
)

NAN = float("nan")


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def make_sentence(kind="order", groups=("a", "b", "c"), least=0.05, **changes):
    choice = (
        Option(name="code", asks="?", why="!", options={"x": "stated", "y": "far", "z": "far"}),
        Option(name="angle", asks="?", why="!", options={"30": "natural", "15": "natural"}),
    )
    plain = {
        "id": "s",
        "figure": "Fig. 1",
        "says": "it rises",
        "paper": "stated",
        "unit": "bits",
    }
    plain |= {"section": "reading", "measure": "values", "identical": "order", "choice": choice}
    return Sentence(**(plain | {"kind": kind, "groups": groups, "least": least} | changes))


def points(*values):
    return [(value, NAN, NAN) for value in values]


def test_every_declared_sentence_has_a_main_reading_and_known_words():
    sentences = load_sentences()
    assert len({one.id for one in sentences}) == len(sentences) > 30
    for one in sentences:
        assert set(one.main) == {choice.name for choice in one.choice}
        assert one.is_main(one.main)
        assert one.weigh(one.main) in NATURAL
        assert len(one.target) in (0, len(one.groups))
    similar, distant = (
        next(s for s in sentences if s.id == f"speed-{index}-tensor")
        for index in ("nmi", "mse")
    )
    assert similar.groups == distant.groups[::-1]  # a distance falls where similarities rise


def test_an_unknown_word_is_refused_with_those_that_are_known():
    with pytest.raises(InvalidInput, match="valid: stated, natural, possible, far"):
        Option(name="code", asks="?", why="!", options={"x": "obvious"})


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("order", (0.1, 0.3, 0.9), True),
        ("order", (0.9, 0.3, 0.1), False),
        ("order", (0.1, 0.95, 0.9), False),  # the middle counts
        ("order", (0.50, 0.51, 0.52), False),  # below the least effect
        ("greatest", (0.3, 0.1, 0.9), True),
        ("greatest", (0.3, 0.88, 0.9), False),
        ("least", (2.7, 2.8, 1.9), True),
        ("dip", (1.0, 0.8, 1.2), True),
        ("dip", (1.0, 1.1, 1.2), False),
        ("order", (0.1, NAN, 0.9), None),
    ],
)
def test_a_reading_agrees_by_its_kind_and_a_least_effect(kind, values, expected):
    assert agree(make_sentence(kind), points(*values)) is expected


@pytest.mark.parametrize("kind", ["order", "greatest", "least", "dip"])
def test_equal_groups_agree_with_no_comparison_whatever_the_least_effect(kind):
    for value in (0.0, 1.0):
        for sentence in (make_sentence(kind, least=0.0, share=0.0), make_sentence(kind)):
            assert agree(sentence, points(value, value, value)) is False


def test_a_named_bound_is_met_where_it_is_reached():
    above = make_sentence("above", ("a",), target=(0.75,))
    assert [agree(above, points(v)) for v in (0.75, 0.74)] == [True, False]


def test_evidence_is_asked_for_both_ways():
    dip = make_sentence("dip")
    wide = [(1.05, 0.9, 1.2), (1.0, 0.9, 1.1), (1.05, 0.95, 1.2)]
    assert agree(dip, wide) is None  # no dip at its least effect, but one is within the spreads
    assert agree(dip, [(1.2, 1.15, 1.25), (1.0, 0.9, 1.1), (1.2, 1.15, 1.25)]) is True
    assert agree(dip, [(1.0, 0.98, 1.01), (1.5, 1.4, 1.6), (1.0, 0.98, 1.01)]) is False
    overlap = [(0.1, 0.0, 0.7), (0.3, 0.2, 0.8), (0.6, 0.1, 0.9)]
    assert agree(make_sentence(), overlap) is None


def test_values_agree_within_their_tolerance_and_factors_in_one_minus_the_value():
    value = make_sentence("value", ("a",), target=(2.0,), tolerance=0.1)
    assert [agree(value, points(v)) for v in (2.19, 1.81, 2.21)] == [True, True, False]
    factor = make_sentence("factor", ("a", "b"), target=(0.98, 0.7), tolerance=2.0)
    assert agree(factor, points(0.965, 0.8)) is True
    assert (
        agree(factor, points(0.995, 0.7)) is False
    )  # near 1 a small distance is a large factor


def test_effects_of_ratios_do_not_depend_on_the_unit():
    ratio = make_sentence(ratio=True)
    assert measure_effect(ratio, (1.0, 2.0, 4.0)) == pytest.approx(
        measure_effect(ratio, (1e-6, 2e-6, 4e-6))
    )


def test_the_verdict_is_one_of_four_words():
    assert decide([True, False]) == WORDS[0]
    assert decide([False, None, True, False]) == WORDS[1]
    assert decide([False, None]) == WORDS[2]
    assert decide([None, False]) == WORDS[3]


def test_noise_is_reproduced_no_more_often_than_by_chance(rng):
    sentence = make_sentence()
    chances = [sentence.find_chance((0.5, NAN, NAN), 1, starts=False)] * 40
    assert chances[0] == pytest.approx(1 / 6)  # one order of three
    found = [
        decide([agree(sentence, points(*rng.random(3))) for _ in chances], chances)
        for _ in range(200)
    ]
    assert sum(one in WORDS[:2] for one in found) <= 20  # a twentieth is expected
    more = [*[True] * 20, *[False] * 19]
    assert decide([False, *more], chances) == WORDS[1]
    assert decide([True, *more], chances) == decide([True, False], [0.005, 1 / 6]) == WORDS[0]


def list_readings(rule):
    chosen = [{"code": c, "angle": a} for c in "xyz" for a in ("30", "15")]
    return [(one, rule(one)) for one in chosen for _ in range(5)]


def test_the_derived_line_finds_a_planted_rule_and_says_how_well_it_fits():
    line = find_rule(
        make_sentence(), list_readings(lambda c: c["code"] != "y" and c["angle"] == "30")
    )
    assert "comes out if code is not “y” and angle is “30” (10 of 10)" in line
    assert "not if" in line and "fits 30 of 30" in line
    assert "under every reading" in find_rule(make_sentence(), list_readings(lambda c: True))
    assert "under no reading" in find_rule(make_sentence(), list_readings(lambda c: False))


def test_readings_that_leave_it_open_are_counted_apart():
    line = find_rule(
        make_sentence(), list_readings(lambda c: None if c["code"] == "z" else c["code"] == "x")
    )
    assert "10 of 20 readings agree, 10 say nothing" in line


def test_a_single_start_is_drawn_evenly_and_the_best_of_all_by_its_chance():
    sentence = make_sentence("dip", ("M3", "M4", "M5"), least=0.0)
    low, high = np.array([1.0, 1.0]), np.array([2.0, 0.5])  # the better start shows no dip
    rows = make_rows(
        sentence, [({"code": "x", "angle": "30"}, {"M3": low, "M4": high, "M5": low}, {})]
    )
    assert rows[0]["share"] == pytest.approx(1 / 2)
    assert rows[0]["looser"] >= rows[0]["share"] >= rows[0]["stricter"]
    best = readings._share_draws(
        sentence, [low, high, low], {"fit": "best of all starts"}, sentence.least
    )
    assert best == pytest.approx(1 / 4)  # the second start alone, twice out of two


def test_groups_within_an_order_of_fits_may_overlap_as_long_as_medians_are_in_order():
    sentence = make_sentence("order", ("fast", "medium", "slow"), least=0.05)
    fast, slow = np.array([0.40, 0.45, 0.42]), np.array([0.90, 0.95, 0.92])

    def find(medium, slow=slow):
        starts = {"fast": fast, "medium": np.array(medium), "slow": slow}
        return make_rows(sentence, [({"code": "x", "angle": "30"}, starts, {})])[0]

    assert find([0.45, 0.44, 0.48])["agrees"] == 1  # below fast in the second start
    assert np.isnan(find([0.41, 0.50, 0.41])["agrees"])  # its median is not
    assert find([0.30, 0.31, 0.29])["agrees"] == 0  # in none of them
    assert find([0.45, 0.44, 0.48], 0.5 - slow)["agrees"] == 0


def test_identical_touches_that_show_the_effect_are_named_and_the_main_reading_decides():
    sentence = load_sentences()[[one.id for one in load_sentences()].index("lda-speed")]
    fast, medium, slow = (
        {"fast": f, "medium": m, "slow": s} for f, m, s in [(0.1, 0.3, 0.9)] * 3
    )
    main = {name: option for name, option in sentence.main.items()}
    others = [main | {"code": code} for code in ("sparse", "ridge")]
    noisy = main | {"components": "noisy copies"}
    reverse = {"fast": 0.9, "medium": 0.5, "slow": 0.2}
    rows = make_rows(
        sentence,
        [
            (main, fast, slow),
            *((one, medium, dict.fromkeys(fast, 0.03)) for one in others),
            (noisy, reverse, {}),
        ],
    )
    table = pd.DataFrame(rows, columns=[*COLUMNS, "choices"])
    found = judge_sentences(table)["lda-speed"]
    assert found.verdict == WORDS[0]
    assert "identical touches show the same effect" in found.note
    assert "2 other readings agree in which identical touches do not" in found.note
    assert found.rows.groupby("reading")["identical"].first().sum() == 1
    assert (
        judge_sentences(table)["lda-profile"].verdict == WORDS[3]
    )  # nothing was computed of it


def test_copies_drawn_among_the_components_are_classified_as_copies_drawn_whole(rng):
    codes = np.abs(rng.normal(size=(12, 3, 70))) * np.array([1.0, 0.3, 0.1])[:, None]
    codes *= np.linspace(0.3, 2, 12)[:, None, None]
    components = fit_components(np.concatenate([codes, 0.5 * codes[::-1]]))
    sd, ratio = scale_noise(codes, "each vector", 0.0), 0.9
    noisy, clean = classify_projected(
        codes, components, sd, ratios=(ratio,), n_copies=8, n_repeats=40, rng=rng
    )
    direct = []
    for _ in range(40):
        train, test = (
            codes + ratio * sd[..., None] * rng.normal(size=(8, *codes.shape)) for _ in range(2)
        )
        places = [components.transform(a.reshape(96, -1)) for a in (train, test)]
        labels = np.tile(np.arange(12), 8)
        direct.append(
            LinearDiscriminantAnalysis().fit(places[0], labels).score(places[1], labels)
        )
    spread = np.hypot(np.std(direct), noisy.std()) / np.sqrt(40)
    assert 0.2 < np.mean(direct) < 0.98
    assert abs(noisy.mean() - np.mean(direct)) < 4 * spread
    assert clean.mean() >= noisy.mean()


def test_the_scale_of_noise_is_that_of_a_vector_of_a_touch_or_of_all():
    codes = np.zeros((2, 2, 3))
    codes[0, 0, 1], codes[0, 1, 0], codes[1, 1, 2] = 4.0, 1.0, 2.0
    assert scale_noise(codes, "each vector", 9.0).tolist() == [[4, 1], [0, 2]]
    assert scale_noise(codes, "each touch", 9.0).tolist() == [[4, 4], [2, 2]]
    assert scale_noise(codes, "all touches", 9.0).tolist() == [[9, 9], [9, 9]]


def test_components_of_few_vectors_keep_all_of_them(rng):
    codes = {"slow": rng.random((20, 3, 50)), "fast": rng.random((20, 3, 50))}
    keep = readings_computed._keep_variance
    assert keep(codes, "group's clean", "clean", 0.1) == pytest.approx(1.0)
    assert keep(codes, "all clean", "clean", 0.1) < keep(codes, "group's clean", "clean", 0.1)
    assert keep(codes, "all clean", "noisy copies", 0.3) < keep(
        codes, "all clean", "noisy copies", 0.1
    )


def test_ginis_index_has_its_closed_forms_and_rises_with_hoyers(rng):
    even, one = np.ones((1, 4, 5)), np.zeros((1, 4, 5))
    one[0, 2, 3] = 7.0
    assert compute_gini(even) == pytest.approx(0.0)
    assert compute_gini(one) == pytest.approx(19 / 20)
    powers = np.stack([rng.random((4, 5)) ** p for p in (1, 3, 9)])
    assert (np.diff(compute_gini(powers)) > 0).all()
    assert (np.diff(hoyer_sparseness(powers.reshape(3, -1))) > 0).all()
