"""Design: the score is a bound on known information, spaces hold what they say, and a search finds
what is planted.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import feeler
from feeler.analysis import compute_information
from feeler.antenna.segments import compute_modes
from feeler.decoding import CLASSIFIERS
from feeler.design import Constraints, DesignProblem, DesignTask, Space, optimise, score
from feeler.design.scoring import (
    CHOICES,
    _touch_classes,
    choose_sensors,
    decode,
    estimate_error,
    measure_sensors,
)
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.objects import Nuisances

ANTENNA = feeler.Antenna(
    segment_length=np.full(6, 4.0), segment_mass=2e-4, radius=0.3, stiffness=0.3, damping=2.0
)
TASK = DesignTask(
    objects=("ball", "box"),
    locations=(0.6, 0.9),
    speeds=(0.6,),
    deadline=15.0,
    train=2,
    test=2,
    noise="relative:0.5",
)
SPACE = Space(reference=ANTENNA, stiffness=1, damping=0, span=10.0)


@pytest.fixture(scope="module")
def found():
    return score(ANTENNA, TASK)


def test_the_score_is_that_of_the_touches_that_touch_makes(found):
    trials = TASK.draw_classes(ANTENNA, "test", 0.6)
    angle = feeler.touch(ANTENNA, trials, duration=TASK.duration)["angle"].values[:, :, 6:]
    assert np.array_equal(
        _touch_classes(ANTENNA, TASK, "test", 0.6).reshape(angle.shape), angle
    )
    assert 0 < found.bits < 2 and 0 < found.errors < 1
    assert found.confusion.sum(axis=1) == pytest.approx(1.0)
    assert found.errors == pytest.approx(1 - np.trace(found.confusion) / 4)
    assert found.errors == pytest.approx(found.wrong.mean())


@pytest.mark.parametrize("classifier", ["templates", "svm"])
def test_any_classifier_may_be_asked(classifier):
    """Templates are the score's own decoder, met by other noise."""
    made = score(
        ANTENNA, TASK, classifier=CLASSIFIERS["svm"](5) if classifier == "svm" else classifier
    )
    assert made.confusion.sum(axis=1) == pytest.approx(1.0)
    assert made.bits < 2


def test_templates_are_the_score_s_own_decoder():
    common = TASK.replace(noise="common:0.02")
    own, other = (score(ANTENNA, common, classifier=who) for who in (None, "templates"))
    assert other.bits == pytest.approx(own.bits, abs=0.1)
    assert other.errors == pytest.approx(own.errors, abs=0.05)


def test_purposes_meet_different_touches_and_antennas_the_same():
    first, second = (
        [t.location for t in TASK.draw_classes(ANTENNA, name, 0.6)]
        for name in ("test", "final")
    )
    softer = TASK.draw_classes(ANTENNA.replace(stiffness=0.1), "test", 0.3)
    assert not set(first) & set(second)
    assert [t.location for t in softer] == first


def test_who_is_asked_about_new_touches_has_met_none_of_them():
    places, new = (0.5, 0.7, 0.9), (0.55, 0.6, 0.8)
    known = Nuisances(location=list(places), size=0.0)
    task = TASK.replace(
        locations=(0.7,), nuisances=known, unseen=known.replace(location=list(new))
    )
    touches = np.array([t.location for t in task.draw_classes(ANTENNA, "test", 0.6)])
    lessons, asked = np.split(touches.reshape(task.n_classes, -1), [task.train], axis=1)
    assert {*lessons.ravel()} <= {*places} and {*asked.ravel()} <= {*new}
    before = task.replace(unseen=None).draw_classes(ANTENNA, "test", 0.6)
    assert np.array_equal(
        lessons, np.reshape([t.location for t in before], (task.n_classes, -1))[:, : task.train]
    )


@pytest.mark.parametrize(("held", "power"), [("total", 0), ("tip", 2)])
def test_a_space_keeps_a_compliance(held, power):
    space = SPACE.replace(stiffness=3, held=held)
    made = space.build(np.array([0.5, -1.0, 0.2])).antenna
    arm = (ANTENNA.length - ANTENNA.hinge_position) ** power
    assert np.sum(arm / made.stiffness) == pytest.approx(np.sum(arm / ANTENNA.stiffness))
    assert np.ptp(made.stiffness) > 0


def test_a_search_for_accuracy_counts_errors():
    found = optimise(TASK, SPACE, aim="accuracy", evaluations=3)[0]
    assert found.best.cost == found.best.errors
    with pytest.raises(InvalidInput, match="right"):
        optimise(TASK.replace(noise="relative:1e-6"), SPACE, aim="accuracy", evaluations=1)


@pytest.mark.parametrize("sd", [0.3, 1.0, 3.0])
def test_without_nuisances_the_decoder_is_the_ideal_one(sd, monkeypatch):
    """Then bits are the mutual information itself, which the information room computes in another
    way.
    """
    monkeypatch.setattr("feeler.design.scoring.N_DRAWS", 2000)
    rng = np.random.default_rng(0)
    means = rng.standard_normal((4, 1, 30)) * 0.5
    bits, _ = decode(np.repeat(means, 3, axis=1), 2, sd)
    ideal = compute_information(means[:, 0], sd, n_draws=2000)
    assert bits.mean() == pytest.approx(ideal.bits, abs=0.03)


def test_nuisances_cost_bits_and_the_score_stays_below_what_is_known():
    rng = np.random.default_rng(1)
    means = rng.standard_normal((4, 1, 20))
    clean, moved = (
        decode(means + size * rng.standard_normal((4, 9, 20)), 5, 0.5)[0].mean()
        for size in (0.0, 0.5)
    )
    assert moved < clean <= 2.0


def test_the_standard_error_is_the_spread_of_the_mean_over_touches_drawn_anew():
    """Classes and speeds are given: they differ, and add nothing to it."""
    rng = np.random.default_rng(3)
    levels = 5 * rng.standard_normal((2, 6, 1))
    draws = rng.standard_normal((400, 1, 6, 4)) + 0.1 * rng.standard_normal((400, 2, 6, 4))
    found = [estimate_error(levels + draw) for draw in draws]
    means = (levels + draws).mean(axis=(1, 2, 3))
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(means.std(), rel=0.1)
    assert np.isnan(estimate_error(levels))


def test_the_score_is_smooth_where_accuracy_is_a_staircase():
    scale = np.linspace(1.0, 1.02, 9)
    rng = np.random.default_rng(2)
    tensors = rng.standard_normal((4, 5, 20)) * 0.6
    bits = np.array([decode(s * tensors, 3, 1.0)[0].mean() for s in scale])
    assert np.abs(np.diff(bits, 3)).max() < 1e-3 * np.ptp(bits)


def test_a_space_has_its_reference_in_the_middle_and_its_bounds_at_one():
    space = Space(
        reference=ANTENNA,
        stiffness=2,
        damping=1,
        span=10.0,
        length=(0.5, 2.0),
    )
    middle, far = (space.build(np.full(len(space.names), x)) for x in (0.0, 1.0))
    assert middle.antenna == ANTENNA.replace(name="design")
    assert far.antenna.stiffness == pytest.approx(3.0)
    assert far.antenna.length == pytest.approx(48.0)


def test_two_knots_hold_every_exponential_profile():
    cockroach = feeler.presets.cockroach()
    built = (
        Space(reference=cockroach, stiffness=2, damping=0).build(np.array([-0.3, 0.4])).antenna
    )
    assert np.diff(np.log(built.stiffness), 2) == pytest.approx(0.0, abs=1e-12)


def test_constraints_say_what_is_broken_and_by_how_much():
    floppy = ANTENNA.replace(damping=ANTENNA.damping / 4)
    ratio = compute_modes(ANTENNA, 6).damping_ratio.min()
    assert Constraints(damping_share=1.0).check(floppy, ANTENNA)[
        "damping_share"
    ] == pytest.approx(np.log(4))
    assert Constraints(damping_ratio=ratio / 2).check(floppy, ANTENNA)[
        "damping_ratio"
    ] == pytest.approx(np.log(2))
    assert Constraints(mass=0.6).check(ANTENNA, ANTENNA)["mass"] == pytest.approx(np.log(2))
    assert Constraints(compliance=(0.5, 2.0)).check(ANTENNA, ANTENNA) == {"compliance": 0.0}
    soft = ANTENNA.replace(stiffness=ANTENNA.stiffness / 3)
    assert Constraints(compliance=(0.5, 1.5)).check(soft, ANTENNA)[
        "compliance"
    ] == pytest.approx(np.log(2))
    assert Constraints(softest=1.0).check(soft, ANTENNA)["softest"] == pytest.approx(np.log(3))
    assert Constraints(thickness=0.5).check(soft, ANTENNA)["thickness"] > 0
    assert Constraints(peak_angle=0.1).check_peak(0.2) == pytest.approx(np.log(2))


def search(path=None, **changes):
    asked = {"evaluations": 12, "seed": 1, "journal": path, "workers": 1}
    return optimise(TASK, SPACE, **(asked | changes))[0]


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    path = tmp_path_factory.mktemp("design") / "journal"
    return search(path), path


def test_a_search_beats_its_reference_on_its_own_draws(searched):
    result, _ = searched
    assert result.best.bits > score(ANTENNA, TASK, "optimiser").bits
    assert result.counts["simulated"] >= 12
    assert [cost for _, cost in result.history] == sorted(
        (cost for _, cost in result.history), reverse=True
    )


def test_an_interrupted_search_goes_on_with_the_same_numbers(searched, tmp_path, monkeypatch):
    whole, path = searched
    part = tmp_path / "journal"
    part.write_bytes(b"\n".join(path.read_bytes().split(b"\n")[:7]) + b"\n" + b'{"x": [0.1')
    again = search(part)
    assert np.array_equal(again.best.x, whole.best.x) and again.history == whole.history
    assert len(part.read_bytes()) == len(path.read_bytes()) or part.read_text().count(
        "\n"
    ) == path.read_text().count("\n")
    asked = []
    monkeypatch.setattr(
        "feeler.design.search.score",
        lambda *args, **options: asked.append(args) or score(*args, **options),
    )
    assert np.array_equal(search(part).best.x, whole.best.x)
    assert len(asked) == 1  # the reference; all candidates are known now


def test_resumed_with_another_task_it_says_so(searched):
    with pytest.raises(InvalidInput, match="belongs to another search"):
        optimise(TASK.replace(noise="relative:0.6"), SPACE, evaluations=2, journal=searched[1])


def test_a_candidate_that_diverges_is_counted_and_never_wins(monkeypatch):
    true = score

    def sometimes(antenna, *args, **options):
        if antenna.stiffness[0] > 1.2 * ANTENNA.stiffness[0]:
            raise SimulationDivergedError("planted", 1.0)
        return true(antenna, *args, **options)

    monkeypatch.setattr("feeler.design.search.score", sometimes)
    result = search()
    assert result.counts["diverged"] > 0
    assert result.best.fate == "simulated"


@pytest.mark.parametrize(
    ("level", "words"),
    [(300.0, "nothing can be told in this noise"), (1e-4, "nothing is left to gain")],
)
def test_a_hopeless_task_is_refused_before_minutes_are_spent(level, words, monkeypatch):
    monkeypatch.setattr("feeler.design.search._find_start", None)
    with pytest.raises(InvalidInput, match=words):
        optimise(TASK.replace(noise=f"relative:{level}"), SPACE)


def test_constraints_that_exclude_all_are_named():
    with pytest.raises(
        InvalidInput, match=r"exclude every antenna .* mass is missed by a factor of at least 2"
    ):
        optimise(TASK, SPACE, Constraints(mass=0.6))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: DesignTask(objects=("ball",), locations=(0.5,)), "nothing to discriminate"),
        (
            lambda: DesignTask(seeds={"optimiser": 1, "test": 1, "final": 2}),
            "seeds .* must differ",
        ),
        (
            lambda: DesignTask(noise="pink"),
            "unknown noise model 'pink'; valid: relative, common",
        ),
        (lambda: DesignTask(noise="relative:0"), "noise of a design's task must be > 0"),
        (lambda: DesignTask(speeds=()), "speeds must be"),
        (lambda: DesignTask(train=1), "train must be ≥ 2"),
        (lambda: DesignTask(nuisances={"colour": 1.0}), "Nuisances has no 'colour'"),
        (
            lambda: optimise(TASK, SPACE, method="lbfgs"),
            "unknown method of design 'lbfgs'; valid: cma",
        ),
        (lambda: Space(reference=ANTENNA, stiffness=0, damping=0), "no freedom"),
        (lambda: Space(reference=ANTENNA, stiffness=7), "0 to 6 knots"),
        (lambda: Space(reference=ANTENNA, length=(1.5, 2.0)), "length must be factors"),
        (lambda: Constraints(mass=-1.0), "mass must be > 0"),
        (lambda: Constraints(compliance=(2.0, 1.0)), "compliance must be shares"),
        (
            lambda: TASK.draw_classes(ANTENNA, "training", 0.6),
            "drawn for one of optimiser, test, final",
        ),
    ],
)
def test_wrong_input_is_refused_in_plain_words(make, words):
    with pytest.raises(InvalidInput, match=words):
        make()


def test_evaluations_are_all_candidates_but_those_that_constraints_left_out():
    counts = {"simulated": 5, "excluded": 2, "diverged": 3, "peak": 4}
    assert DesignProblem.evaluations.fget(SimpleNamespace(counts=counts)) == 12


@pytest.fixture(scope="module")
def planted():
    """Six sensors of which the fourth and the second tell the classes, the fourth better."""
    tensors = 0.01 * np.random.default_rng(0).standard_normal((3, 4, 6, 5))
    tensors[:, :, 3] += np.array([-1.0, 0.0, 1.0])[:, None, None]
    tensors[:, :, 1] += np.array([0.3, -0.6, 0.3])[:, None, None]
    return tensors


def test_the_sensors_that_tell_are_chosen_first(planted):
    assert list(CHOICES["d-optimal"](planted, 0.5, 2)) == [3, 1]


@pytest.mark.parametrize("choice", ["d-optimal", "even", "random"])
def test_all_sensors_tell_what_the_antenna_tells_and_fewer_less(choice):
    whole = feeler.design.score(ANTENNA, TASK, "test", workers=1)
    one, all_ = measure_sensors(ANTENNA, TASK, [1, 6], choice)
    assert all_ == pytest.approx(whole.bits)
    assert one < all_
    few = ANTENNA.replace(sensors=[2, 5, 6])  # hinges that are not the numbers of their sensors
    assert set(choose_sensors(few, TASK, 2, choice)) <= {2, 5, 6}


def test_sensors_are_chosen_on_other_touches_than_those_they_are_asked_about(monkeypatch):
    seen = []
    monkeypatch.setitem(
        CHOICES.data, "spy", lambda tensors, _, n: seen.append(tensors) or np.arange(n)
    )
    measure_sensors(ANTENNA, TASK, [2], "spy")
    known = _touch_classes(ANTENNA, TASK, "optimiser", TASK.speeds[0])
    peaks = np.abs(known).max(axis=(2, 3), keepdims=True)
    np.testing.assert_allclose(seen[0], known / peaks)


def test_more_sensors_than_there_are_are_refused():
    with pytest.raises(InvalidInput, match="at most the antenna's 6 sensors"):
        choose_sensors(ANTENNA, TASK, 7)
