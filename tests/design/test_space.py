"""Designs in space: profiles of both planes of bending, touches from around, the same verbs."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.design import Constraints, Space, score
from feeler.design.plan import make_strips, measure_tolerance
from feeler.design.scoring import _touch_classes, choose_sensors, measure_sensors
from feeler.design.search import match_compliance
from feeler.errors import InvalidInput
from feeler.objects import Nuisances
from feeler.tensors.transforms import stack_planes
from tests.design.test_design import ANTENNA, TASK
from tests.design.test_plan import TEXT

pytestmark = pytest.mark.long

EVEN = ANTENNA.unflatten()
TWISTING = EVEN.replace(
    stiffness=np.stack([np.full(6, 0.3), np.linspace(0.9, 0.4, 6), np.full(6, 5.0)]),
    damping=np.stack([np.full(6, 2.0), np.full(6, 3.0), np.full(6, 7.0)]),
    rest_angle=np.zeros((3, 6)),
)
AROUND = TASK.replace(nuisances=Nuisances(azimuth=50.0))


@pytest.mark.parametrize(
    "antenna",
    [EVEN, pytest.param(TWISTING, marks=pytest.mark.long)],
    ids=["two planes", "torsion too"],
)
def test_the_score_is_that_of_the_touches_that_touch_makes(antenna):
    trials = AROUND.draw_classes(antenna, "test", 0.6)
    assert len({trial.azimuth for trial in trials}) > 4
    touches = feeler.touch(antenna, trials, duration=AROUND.duration)
    angle = stack_planes(touches["angle"]).values[:, :, 6:]
    found = _touch_classes(antenna, AROUND, "test", 0.6)
    assert found.shape[:3] == (4, 4, len(antenna.planes) * 6)
    np.testing.assert_array_equal(found.reshape(angle.shape), angle)
    assert np.abs(found[:, :, 6:12]).max() > 1e-3


def test_touches_within_the_plane_score_as_planar_ones():
    """To what the two engines differ; contact is softer in space (see docs/space.md)."""
    flat, space = (_touch_classes(one, TASK, "test", 0.6) for one in (ANTENNA, EVEN))
    assert not space[:, :, 6:].any()
    assert np.abs(space[:, :, :6] - flat).max() < 0.1 * np.abs(flat).max()


@pytest.mark.parametrize("held", ["nothing", "total", "tip"])
def test_factors_are_those_of_both_planes_and_torsion_stays(held):
    x = np.array([0.5, -1.0, 0.2, 0.3, -0.4])
    fields = {"stiffness": 3, "damping": 2, "span": 10.0, "held": held}
    flat = Space(reference=TWISTING.flatten(), **fields).build(x).antenna
    made = Space(reference=TWISTING, **fields).build(x).antenna
    for name in ("stiffness", "damping"):
        own, reference = getattr(made, name), getattr(TWISTING, name)
        np.testing.assert_array_equal(own[2], reference[2])
        np.testing.assert_allclose(own[1] / reference[1], own[0] / reference[0])
        if held == "nothing" or name == "damping":
            np.testing.assert_array_equal(own[0], getattr(flat, name))
    arm = TWISTING.length - TWISTING.hinge_position
    for weight in {"total": [arm**0], "tip": [arm**2]}.get(held, []):
        kept = [np.sum(weight / one.stiffness[:2]) for one in (made, TWISTING)]
        assert kept[0] == pytest.approx(kept[1])


@pytest.mark.parametrize("held", ["total", "tip"])
def test_who_bends_alike_in_both_planes_keeps_the_planar_compliance(held):
    shape = np.linspace(2.0, 0.1, 6)
    flat = match_compliance(shape, ANTENNA, held)
    np.testing.assert_allclose(match_compliance(np.stack([shape] * 2), EVEN, held), [flat] * 2)
    with pytest.raises(
        InvalidInput, match=r"for each of the 6 segments .*\(2, 6\), got .*\(6,\)"
    ):
        match_compliance(shape, EVEN, held)


@pytest.mark.parametrize(("held", "power"), [("total", 0), ("tip", 2)])
def test_compliance_is_held_at_every_length(held, power):
    """Of an arm twice as long the tip gives four times as much, unless it is stiffer."""
    space = Space(reference=ANTENNA, stiffness=2, damping=0, length=(0.5, 2.0), held=held)
    for rest in (-1.0, 0.0, 0.4, 1.0):
        antenna = space.build(np.array([0.3, -0.1, rest])).antenna
        found, wanted = (
            np.sum((one.length - one.hinge_position) ** power / one.stiffness)
            for one in (antenna, ANTENNA)
        )
        assert found == pytest.approx(wanted)
        assert antenna.length == pytest.approx(2.0**rest * ANTENNA.length)


def test_constraints_are_on_bending_and_torsion_counts_in_none():
    wrung = TWISTING.stiffness.copy()
    wrung[2] = 1e-6
    for kept in (Constraints(compliance=(1.0, 1.0)), Constraints(softest=1.0)):
        assert [*kept.check(TWISTING.replace(stiffness=wrung), TWISTING).values()] == [0.0]
    cut = Constraints(thickness=9.0).check(TWISTING.replace(stiffness=wrung), TWISTING)
    stiffness = TWISTING.stiffness[:2] * TWISTING.segment_length  # k ℓ = E π d⁴ / 64
    thinnest = (64 * stiffness.min() / (np.pi * Constraints().modulus)) ** 0.25
    assert cut["thickness"] == pytest.approx(np.log(9.0 / thinnest))
    softer = TWISTING.stiffness * np.array([[1.0], [0.1], [1.0]])
    broken = Constraints(softest=0.5).check(TWISTING.replace(stiffness=softer), TWISTING)
    assert broken["softest"] == pytest.approx(np.log(0.5 * 0.3 / 0.04))


def test_a_sensor_is_chosen_with_all_that_it_feels():
    """All six sensors tell what the antenna tells; one tells less."""
    few = EVEN.replace(sensors=[2, 5, 6])
    whole = score(few, AROUND, "test", workers=1)
    one, all_ = measure_sensors(few, AROUND, [1, 3])
    assert all_ == pytest.approx(whole.bits) and one < all_
    assert set(choose_sensors(few, AROUND, 2)) <= {2, 5, 6}


@pytest.mark.parametrize("make", [make_strips, lambda one: measure_tolerance(one, TASK)])
def test_flexures_are_cut_for_one_plane_and_say_so(make):
    with pytest.raises(InvalidInput, match=r"flexures.* works in the plane, and .*flatten"):
        make(EVEN)


def test_the_verb_searches_in_space_and_refuses_the_robot(tmp_path):
    feeler.save_antenna(TWISTING, tmp_path / "small.toml")
    plan = tmp_path / "task.toml"
    plan.write_text(
        TEXT.replace("[task.seeds]", "[task.nuisances]\nazimuth = 50\n[task.seeds]")
    )
    asked = ["design", str(plan), "--out", str(tmp_path / "out"), "--no-movie", "--json"]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    kept = json.loads((tmp_path / "out" / "design.json").read_text())
    best = feeler.load_antenna(tmp_path / "out" / "antenna.toml")
    np.testing.assert_allclose(best.stiffness[2], 5.0)
    task = feeler.design.load_plan(plan).task
    assert score(best, task, "final").bits == pytest.approx(kept["final"]["bits"])
    refused = CliRunner().invoke(app, [*asked, "--robot"])
    assert isinstance(refused.exception, InvalidInput) or "--robot works in the plane" in (
        refused.output
    )
