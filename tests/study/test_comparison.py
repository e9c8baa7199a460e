"""Antennas side by side: each measure is the library's own, and the page says it in its unit."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import feeler
from feeler import comparison as compare
from feeler.analysis import bootstrap_difference, compute_dispersion
from feeler.comparison import compare_antennas, plot
from feeler.decoding import list_groups, make_lda
from feeler.decoding.classifiers import make_svm
from feeler.encoding import LABELS, compute_histogram_entropy
from feeler.errors import ModelValidityWarning
from feeler.experiments.tactile import DURATION
from feeler.objects.trials import trials
from paper.data import complete_tensors
from paper.scale import SCALES


@pytest.fixture(scope="module")
def sets():
    effort = SCALES["smoke"]
    touches = [
        t
        for t in trials(locations=effort.locations)
        if t.speed == 0.6 and t.name in effort.shapes
    ]
    antennas = {
        "robot": feeler.presets.robot(),
        "uniform": feeler.presets.cockroach("uniform"),
    }
    return {
        name: feeler.touch(antenna, touches, duration=40.0)
        for name, antenna in antennas.items()
    }


@pytest.fixture(scope="module")
def compared(sets):
    effort = SCALES["smoke"]
    return compare_antennas(
        sets, effort.make_encoder(random_state=0), plan=effort.plan, random_state=3
    )


def test_measures_are_those_of_the_library(sets, compared):
    listed = list_groups(sets, reference="robot")["profile"]
    dispersion = compute_dispersion({name: array for name, (array, _) in listed.items()})
    for name, (array, _) in listed.items():
        assert compared.peak[name] == float(np.abs(sets[name]["angle"]).max())
        flat = array.reshape(len(array), -1)
        root = np.sqrt(flat.shape[1])
        hoyer = (root - np.abs(flat).sum(axis=1) / np.sqrt((flat**2).sum(axis=1))) / (root - 1)
        assert compared.sparseness[name] == pytest.approx(hoyer.mean())
        for index, average in dispersion.average.items():
            assert compared.dispersion["raw"].average[index][name] == average[name]
        fitted = SCALES["smoke"].make_encoder(random_state=0)
        fitted.fit(array)
        entropy = np.mean([compute_histogram_entropy(basis) for basis in fitted.components_])
        assert compared.entropy[name] == pytest.approx(entropy)
    rng = np.random.default_rng(3)
    for kind in ("sparse", "raw"):
        for noise in compared.curves.noises:
            robot, other = compared.curves.find(kind, noise).values()
            found = compared.differences[f"accuracy, {LABELS[kind]}, {noise} noise", "uniform"]
            assert found == bootstrap_difference(robot.area, other.area, rng)


def test_the_picture_is_in_per_cent(compared):
    plot(compared, figure := Figure(figsize=(10.0, 6.5)))
    panels = figure.axes[4:]
    assert {ax.get_xlabel() for ax in panels} == {"noise [%]"} and panels[
        0
    ].get_ylabel() == "accuracy [%]"
    assert [ax.get_title() for ax in figure.axes[:4]] == [
        f"{name}, tensors" for name in ("Pearson r", "SSIM", "MSE", "NMI")
    ]


def test_one_antenna_is_no_comparison(sets):
    with pytest.raises(feeler.errors.InvalidInput, match="at least two antennas"):
        compare_antennas({"robot": sets["robot"]}, None, plan=SCALES["smoke"].plan)


@pytest.mark.further
@pytest.mark.parametrize("classifier", [make_lda(24), make_svm(24)])
def test_what_rounding_leaves_is_no_component_that_a_classifier_sees(sets, classifier):
    """As many copies as a classifier has components: the last one is a hair's, and scaled it was as
    long as the others.
    """
    effort = SCALES["smoke"]
    plan = effort.plan.replace(n_copies=3, other_copies=())
    assert 3 * len(sets["robot"]["trial"]) == 24
    rng = np.random.default_rng(1)
    hair = {
        name: data.assign(
            angle=data["angle"] * (1 + 1e-14 * rng.normal(size=data["angle"].shape))
        )
        for name, data in sets.items()
    }
    found, moved = (
        compare_antennas(
            given, effort.make_encoder(random_state=0), plan=plan, classifier=classifier
        ).curves.find("raw", "common")
        for given in (sets, hair)
    )
    for name in sets:
        np.testing.assert_array_equal(found[name].noisy, moved[name].noisy)


BALL = feeler.Ball(radius=1.5)


@pytest.mark.parametrize(("name", "speed"), [("exponential", 0.3), ("uniform", 0.6)])
def test_they_are_what_the_paper_calls_complete(name, speed):
    antenna = feeler.presets.cockroach(name)
    trials = [feeler.Trial(feature=BALL, location=at, speed=speed) for at in (0.55, 0.8)]
    found, end = compare.touch_whole(antenna, trials, seed=3)
    longer = feeler.touch(antenna, trials, duration=1.7 * 48.0 / speed, seed=3)
    expected = complete_tensors(longer)
    assert found.sizes["time"] == round(DURATION) == expected.sizes["time"]
    held = (longer["force"] != 0).any(("trial", "axis")).values
    assert end == pytest.approx(float(longer["time"].values[held][-1]) + 1.0)
    np.testing.assert_allclose(found["angle"], expected["angle"], atol=1e-9)


def test_a_touch_that_does_not_end_is_cut_and_said(monkeypatch):
    monkeypatch.setattr(compare, "_FACTORS", (1,))
    monkeypatch.setattr(compare, "_DISTANCE", 4.0)
    trial = feeler.Trial(feature=BALL, location=0.5, speed=0.3)
    with pytest.warns(ModelValidityWarning, match="still touched when the recording ends"):
        _, end = compare.touch_whole(feeler.presets.cockroach(), [trial])
    assert end == pytest.approx(round(4.0 / 0.3), abs=1.0)
