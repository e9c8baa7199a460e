"""Units travel with numbers: who takes a quantity out of a Dataset reads its unit."""

import json
from dataclasses import replace

import numpy as np
import pint
import pytest
import xarray as xr
from matplotlib.figure import Figure
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.physics.simulation import Simulation
from feeler.plotting.results import plot_trial
from feeler.plotting.tensors import plot_touch
from feeler.tensors import QUANTITIES, in_unit
from feeler.tradeoff import load_declared

PAIRS = [
    ("mJ", "uJ"), ("N", "mN"), ("N*mm", "uN*m"), ("rad", "deg"), ("1/mm", "1/m"), ("Hz", "kHz"),
    ("rad/ms", "deg/s"), ("mm/ms", "m/s"), ("ms", "s"), ("1/ms", "kHz"), ("N*mm", "mJ"),
    ("kg/m**3", "g/mm**3"), ("1", "1"), ("deg", "mrad"),
]  # fmt: skip
SMALLER = {
    "angle": "mrad",
    "velocity": "rad/s",
    "tip": "um",
    "force": "mN",
    "base_force": "mN",
    "base_moment": "N*um",
    "work": "nJ",
}
"""Of each measured quantity, the unit of which it holds 1,000 times as many."""

ANTENNA = feeler.presets.cockroach()
TRIAL = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.6, speed=0.6)


@pytest.mark.parametrize(("kept", "asked"), PAIRS)
def test_conversions_are_pints(kept, asked):
    array = xr.DataArray([0.3, -7.0], attrs={"units": kept, "long_name": "how much"})
    found = in_unit(array, asked)
    expected = pint.Quantity(array.values, kept).to(asked).magnitude
    np.testing.assert_allclose(found, expected, rtol=1e-15)
    assert found.attrs == {"units": asked, "long_name": "how much"}


def test_every_unit_of_the_contract_is_known_and_stays():
    for quantity in QUANTITIES.values():
        array = xr.DataArray(0.1, attrs={"units": quantity.unit})
        assert in_unit(array, quantity.unit) is array
        assert not quantity.unit or in_unit(array, f"1*{quantity.unit}") == 0.1


@pytest.mark.parametrize("spelling", ["µJ", "μJ", "uJ", "N·mm"])
def test_micro_and_products_are_read_as_people_write_them(spelling):
    factor = 1e3 if "J" in spelling else 1.0
    assert in_unit(xr.DataArray(1.0, attrs={"units": "mJ"}), spelling) == factor


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        (None, "'work' says no unit"),
        ("mm", "'work' is in mm, which cannot be converted to uJ"),
        ("furlong", "unknown unit 'furlong'"),
        ("", "'' is no unit"),
        ("m//s", "'m//s' is no unit"),
        ("mm^", "'mm\\^' is no unit"),
        (7, "'7' is no unit"),
    ],
)
def test_a_missing_or_unfitting_unit_is_refused_by_name(kept, words):
    array = xr.DataArray(1.0, name="work", attrs={} if kept is None else {"units": kept})
    with pytest.raises(InvalidInput, match=words):
        in_unit(array, "uJ")


def compare_with_a_simulation():
    """What a Dataset holds, against the numbers of a simulation that is stepped by hand."""
    options = {"timestep": 0.05, "sample_interval": 1.0}
    tensors = feeler.touch(
        ANTENNA, TRIAL, duration=30, all_hinges=True, save=tuple(SMALLER), **options
    )
    simulation = Simulation(ANTENNA, TRIAL, timestep=0.05)
    simulation.step(float(tensors["time"][-1]))
    work = simulation.work
    known = {
        "angle": (simulation.angle, "rad"),
        "velocity": (simulation.velocity, "rad/ms"),
        "tip": (simulation.tip, "mm"),
        "force": (simulation.force.sum(axis=0), "N"),
        "base_force": (simulation.base_force, "N"),
        "base_moment": (simulation.base_moment, "N*mm"),
        "work": ([work.base, work.objects.sum()], "uJ"),
    }
    for name, (values, unit) in known.items():
        last = in_unit(tensors[name], unit).isel(trial=0, time=-1).values
        np.testing.assert_allclose(last, values, rtol=1e-9, atol=1e-12, err_msg=name)
        assert np.abs(values).max() > 1e-6, name


@pytest.fixture(scope="module")
def read_pages(tmp_path_factory):
    """A function that gives every number that leaves the contract for a page or a figure."""

    def read():
        out = tmp_path_factory.mktemp("touch")
        said = CliRunner().invoke(
            app,
            f"touch --no-movie --duration 30 --out {out} --json".split(),
            catch_exceptions=False,
        )
        numbers = {
            name: value
            for name, value in json.loads(said.stdout).items()
            if type(value) is float
        }
        tensors = feeler.touch(ANTENNA, TRIAL, duration=30)
        figure = Figure()
        plot_touch(tensors, figure)
        image = figure.axes[0].images[0]
        numbers |= {"plotted": image.get_array().max(), "until": image.get_extent()[1]}
        study = load_declared(
            sets=1,
            speeds=(1.2,),
            levels={"relative": (1.0,), "common": (0.03,)},
            objects=[feeler.Ball(radius=1.5), feeler.Ball(radius=3)],
        )
        found = study.run({"a": ANTENNA})
        return numbers | {name: float(found[name].mean()) for name in found}

    return read


@pytest.fixture(scope="module")
def pages(read_pages):
    return read_pages()


@pytest.fixture
def rescale(monkeypatch):
    """Multiply a quantity by 1,000, with its unit or without."""

    def change(name, unit):
        kept = QUANTITIES[name]
        changed = replace(
            kept, unit=unit, make=lambda antenna, motion: 1000 * kept.make(antenna, motion)
        )
        monkeypatch.setitem(QUANTITIES.data, name, changed)

    return change


def test_the_contract_holds_what_a_simulation_says():
    compare_with_a_simulation()


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in SMALLER if name != "angle"])
def test_a_number_that_changes_with_its_unit_stays_the_same_on_every_page(
    name, rescale, pages, read_pages
):
    rescale(name, SMALLER[name])
    compare_with_a_simulation()
    assert read_pages() == pytest.approx(pages, rel=1e-9)


@pytest.mark.parametrize("name", SMALLER)
def test_a_number_that_changes_without_its_unit_is_noticed(name, rescale):
    rescale(name, QUANTITIES[name].unit)
    with pytest.raises(AssertionError, match=name):
        compare_with_a_simulation()


@pytest.mark.long
@pytest.mark.parametrize(("name", "printed"), [("force", "force"), ("work", "work")])
def test_a_wrong_unit_reaches_the_trade_off(name, printed, rescale, pages, read_pages):
    rescale(name, QUANTITIES[name].unit)
    assert read_pages()[printed] == pytest.approx(1000 * pages[printed])


def test_a_picture_says_the_unit_of_what_it_draws(rescale):
    rescale("velocity", SMALLER["velocity"])
    tensors = feeler.touch(ANTENNA, TRIAL, duration=10, save=("velocity",))
    ax = plot_trial(tensors, variable="velocity")
    assert ax.images[0].colorbar.ax.get_ylabel() == "velocity [rad/s]"
