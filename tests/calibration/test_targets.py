"""Targets and costs: data at one door, numbers by hand."""

import numpy as np
import pytest

from feeler.calibration import (
    compute_distance,
    compute_residuals,
    compute_symmetric_accuracy,
    load_targets,
    make_targets,
)
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
    assert compute_symmetric_accuracy(
        np.array([2.0, 4.0, 8.0]), np.array([1.0, 2.0, 4.0])
    ) == pytest.approx(1.0)
    assert compute_symmetric_accuracy(1 / simulated, 1 / target) == pytest.approx(
        compute_symmetric_accuracy(simulated, target)
    )
    assert compute_symmetric_accuracy(np.zeros(2), np.ones(2)) == np.inf


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
    assert targets.only("frequency").names == ("frequency",)
    with pytest.raises(InvalidInput, match="targets must be 1 or more"):
        make_targets()
