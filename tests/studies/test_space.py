"""Out of the plane: layouts feel what they say, gains are paired, and nothing gains nothing."""

import numpy as np
import pytest
import xarray as xr

from feeler.presets import cockroach
from paper.statements import judge, load_statements
from paper.table import Results
from studies.space import measure
from studies.space.section import FEW, collect_values
from studies.stored import read_declared

pytestmark = pytest.mark.long

ASKED = read_declared("space")
OWN = [one for one in load_statements() if one.id.startswith("own-space")]
TINY = {"objects": ["ball:radius=0.75", "ball:radius=6.0"], "each": 4, "sets": 2}


def make_cells(draw, sets: int = 12) -> dict:
    cells = {}
    for kind in ("space", "plane"):
        for name in ASKED["antennas"][kind]:
            full = (kind, name) == ("space", "exponential")
            shape = (sets, 2, len(ASKED["layouts"]) if full else len(FEW))
            cells[f"{kind}/{name}"] = draw(shape)
    return cells


def make_angle() -> xr.DataArray:
    values = np.random.default_rng(4).normal(size=(3, 2, 9, 5))
    return xr.DataArray(values, dims=("trial", "plane", "sensor", "time"))


def test_layouts_feel_what_they_say():
    angle = make_angle()
    x, z = angle.values[:, 0], angle.values[:, 1]
    both = measure.Layout(around=(0.0, 90.0), places=9).feel(angle)
    np.testing.assert_allclose(both, np.concatenate([x, z], axis=1), atol=1e-15)
    turned = measure.Layout(turn=90.0, places=9).feel(angle)
    signs = [(x, 1), (z, 1), (x, -1), (z, -1)]
    for k in range(9):
        of, sign = signs[k % 4]
        np.testing.assert_allclose(turned[:, k], sign * of[:, k], atol=1e-15)
    few = measure.Layout(around=(180.0,), places=3, one_way=True).feel(angle)
    np.testing.assert_allclose(few, np.maximum(-x[:, [0, 4, 8]], 0), atol=1e-15)


def test_every_layout_but_the_first_has_as_many_sensors():
    layouts = measure.load_space().levels
    counts = {name: len(one.around) * one.places for name, one in layouts.items()}
    assert counts.pop("both planes") == 112 and {*counts.values()} == {56}
    assert tuple(ASKED["layouts"])[:2] == FEW


def test_those_in_the_plane_are_the_same_touches():
    space, plane = measure.load_space(), measure.load_space("plane")
    antenna = cockroach().unflatten()
    turned, _ = space.task.draw(antenna, "test", set=3)
    flat, _ = plane.task.draw(antenna, "test", set=3)
    assert [trial.replace(azimuth=0.0) for trial in turned] == [*flat]
    assert max(abs(trial.azimuth) for trial in turned) > 30


def test_the_study_goes_on_from_its_journal(tmp_path):
    """And gives what claims need, above chance."""
    found = measure.compute(tmp_path, **TINY)
    written = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert measure.compute(tmp_path, **TINY) == found
    assert written == {path: path.read_bytes() for path in tmp_path.iterdir()}
    values = collect_values(found)
    assert all(one.list_keys() <= set(values) for one in OWN)
    assert values["space.right.plane.exponential.templates.both_planes"]["value"] > 30


def test_gains_are_paired_and_the_nearest_counts():
    rng = np.random.default_rng(1)
    luck = 0.2 * rng.random((12, 1, 1))
    cells = make_cells(lambda shape: 0.5 + luck + np.zeros(shape))
    for name, by in (("linear", 0.3), ("uniform", 0.1), ("matched", 0.2)):
        cells[f"space/{name}"] = cells[f"space/{name}"] - by
    cells["plane/exponential"] = cells["plane/exponential"] + 0.07
    values = collect_values({name: own.tolist() for name, own in cells.items()})
    assert values["space.gradient"] == pytest.approx(
        {"value": 10, "low": 10, "high": 10, "n": 12}
    )
    assert values["space.cost"]["value"] == pytest.approx(7)
    assert values["space.turned"]["value"] == pytest.approx(0, abs=1e-9)
    assert values["space.sets"] == 12


@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_no_rule_is_met_by_planted_nothing(statement):
    """Antennas, directions and layouts that differ in nothing but chance."""
    rng = np.random.default_rng(0)
    for _ in range(10):
        cells = make_cells(lambda shape: 0.5 + 0.03 * rng.standard_normal(shape))
        assert not judge(statement, Results.make(collect_values(cells)), "paper").holds
