"""Targets and costs: data at one door, numbers by hand."""

import numpy as np
import pytest

from feeler.calibration import load_targets, make_targets
from feeler.calibration import traces as recording
from feeler.calibration import traces as trace
from feeler.calibration.fitting import make_starts
from feeler.calibration.hinges import Hinges
from feeler.calibration.problem import (
    compute_distance,
    compute_residuals,
    compute_symmetric_accuracy,
)
from feeler.calibration.traces import Traces
from feeler.errors import InvalidInput


def test_the_shipped_set_says_that_it_is_reconstructed():
    targets = load_targets("cockroach")
    assert targets.status == "reconstructed"
    assert targets.names == ("frequency", "damping_ratio", "ratio_71", "ratio_86")
    np.testing.assert_allclose(targets.values, [0.0175, 0.54, 0.22, 0.55])
    assert {target.tag for target in targets.targets} == {"D"}
    assert np.all(targets.spreads > 0)


def test_costs_by_hand():
    target, simulated = np.array([1.0, 2.0, 4.0, 8.0]), np.array([1.1, 2.0, 3.0, 8.0])
    assert compute_distance(simulated, target) == pytest.approx(np.hypot(0.1, 0.25))


def test_accuracy_is_the_median_of_unequal_ratios():
    """Morley et al. 2018 (https://doi.org/10.1002/2017SW001669), eq. 10: exp(median |ln Q|) − 1;
    one wild ratio moves it not.
    """
    ratios = np.array([1.1, 1.5, 4.0])
    assert compute_symmetric_accuracy(ratios, np.ones(3)) == pytest.approx(0.5, rel=1e-12)
    assert compute_symmetric_accuracy(2 / ratios, np.full(3, 2.0)) == pytest.approx(
        0.5, rel=1e-12
    )
    assert compute_symmetric_accuracy(np.append(ratios, 1 / 1.7), np.ones(4)) == pytest.approx(
        np.sqrt(1.5 * 1.7) - 1
    )
    assert compute_symmetric_accuracy(np.array([1.2, 0.0, 1.3]), np.ones(3)) == pytest.approx(
        0.3
    )
    assert compute_symmetric_accuracy(np.array([1.2, 0.0, -1.0]), np.ones(3)) == np.inf


@pytest.mark.parametrize(
    ("simulated", "target", "match"),
    [
        ([np.nan], [1.0], "no number"),
        ([1.0], [0.0], "target of 0"),
        ([1.0, 2.0], [1.0], "one simulated value per target"),
    ],
)
def test_a_cost_is_never_silently_nan(simulated, target, match):
    with pytest.raises(InvalidInput, match=match):
        compute_residuals(simulated, target)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("name = 'x'", "needs status, targets"),
        ("name = [", "is not valid TOML"),
        (
            "name='x'\nstatus='measured'\n[targets.colour]\nvalue=1\nspread=0\nunit='1'\ntag='C'",
            "name must be one of frequency, .*, got 'colour'",
        ),
        (
            "name='x'\nstatus='m'\n[targets.frequency]\nvalue=-1\nspread=0\nunit='kHz'\ntag='C'",
            "value must be > 0, got -1",
        ),
        (
            "name='x'\nstatus='m'\n[targets.frequency]\nvalue=1\nspread=0\nunit='kHz'\ntag='Z'",
            "tag must be one of P.*, got 'Z'",
        ),
        (
            "name='x'\nstatus='m'\n[targets.frequency]\nvalue=1\nspread=nan\nunit='kHz'\ntag='C'",
            "spread",
        ),
        (
            "name='x'\nstatus='m'\n[targets.frequency]\nvalue=1\nspread=inf\nunit='kHz'\ntag='C'",
            "spread must be finite and ≥ 0, got inf",
        ),
        (
            "name='x'\nstatus='m'\n[targets.frequency]\nvalue=1\nspread=-1\nunit='kHz'\ntag='C'",
            "spread must be ≥ 0, got -1",
        ),
    ],
)
def test_bad_files_say_what_is_wrong(tmp_path, text, match):
    file = tmp_path / "targets.toml"
    file.write_text(text)
    with pytest.raises(InvalidInput, match=match):
        load_targets(file)


def test_a_file_that_is_not_there_lists_the_shipped_sets():
    with pytest.raises(InvalidInput, match="shipped: cockroach"):
        load_targets("nowhere.toml")


def test_own_numbers_become_targets():
    targets = make_targets(frequency=(0.02, 0.001), damping_ratio=0.3)
    assert targets.names == ("frequency", "damping_ratio")
    assert targets.with_values([0.03, 0.4]).values.tolist() == [0.03, 0.4]
    with pytest.raises(InvalidInput, match="targets must be 1 or more"):
        make_targets()


TIME = np.arange(0.0, 60.0, 1.5)


def swing(period, height):
    """A trace that swings and dies down."""
    return height * np.exp(-TIME / 30) * np.cos(2 * np.pi * TIME / period)


def make_traces():
    """Two animals, of which one has three points, in no order and of other heights."""
    names = ("b@0.4", "a", "b", "b@0.7")
    rows = [swing(20, 2.0), swing(25, -9.0), swing(20, 7.0), swing(20, 4.0)]
    return Traces(time=TIME, displacement=np.array(rows), names=names)


def test_an_animal_s_points_rise_and_stand_beside_their_own_places():
    traces = make_traces()
    assert traces.animals == ("b", "a")
    places, rows = traces.take("b")
    assert places.tolist() == [0.4, 0.7, 1.0] and rows[:, 0].tolist() == [2.0, 4.0, 7.0]
    assert traces.take("a")[0].tolist() == [1.0]
    with pytest.raises(InvalidInput, match=r"trace 'c@1\.5': what follows @ is a fraction"):
        recording.read_place("c@1.5")


def make_family(**more):
    """Two parameters, of which one may be negative."""
    known = {
        "name": "own",
        "names": ("stiff", "rate"),
        "units": ("N", "1/joint"),
        "positive": (True, False),
        "start": np.array([2.0, -0.1]),
        "low": np.array([0.5, -0.4]),
        "high": np.array([8.0, 0.4]),
        "build": lambda p: p,
    }
    return Hinges(**known | more)


def test_a_family_s_numbers_are_searched_each_in_its_own_way():
    family = make_family()
    np.testing.assert_allclose(family.to_x([2.0, -0.1]), [np.log(2.0), -0.1])
    np.testing.assert_allclose(family.to_p([[np.log(3.0), 0.2]] * 2), [[3.0, 0.2]] * 2)
    np.testing.assert_allclose(family.scale, [1.0, 0.1])
    np.testing.assert_allclose(family.bounds, [[np.log(0.5), -0.4], [np.log(8.0), 0.4]])
    starts = make_starts(family, 200, np.random.default_rng(1), spread=0.3)
    np.testing.assert_allclose(starts[0], family.start)
    moved = np.array([family.to_x(p) for p in starts[1:]]) - family.to_x(family.start)
    np.testing.assert_allclose(moved.std(axis=0), [0.3, 0.03], rtol=0.15)
    with pytest.raises(InvalidInput, match=r"rate starts at 0\.7, outside its bounds -0\.4 to"):
        make_family(start=np.array([2.0, 0.7]))
    with pytest.raises(InvalidInput, match=r"stiff starts at 2, outside its bounds 2 to 2"):
        make_family(low=np.array([2.0, -0.4]), high=np.array([2.0, 0.4]))
    with pytest.raises(
        InvalidInput, match="one of each for every parameter, got names 3, units 2"
    ):
        make_family(names=("a", "b", "c"))
    with pytest.raises(InvalidInput, match="lower bound of a positive parameter must be > 0"):
        make_family(low=np.array([0.0, -0.4]))


def test_a_release_is_the_last_held_sample_of_either_sign_and_rest_is_the_end_s():
    fall = np.concatenate([np.full(9, 5.0), 5.0 * np.exp(-np.arange(1, 60) / 4)])
    for sign, level in ((1, 0.0), (-1, 12.0)):
        last, rest = trace.find_release(level + sign * fall)
        assert last == 8 and rest == pytest.approx(level, abs=0.01)
    late = np.concatenate([fall[5:], np.zeros(5)])
    with pytest.raises(InvalidInput, match="let go within the first 5 samples"):
        trace.find_release(late, "animal")
