"""Amplitude or geometry: what is only louder, only equal, or planted, is found to be that."""

import numpy as np
import pytest
import xarray as xr

from feeler.objects import Common
from feeler.presets import cockroach
from paper.statements import judge, load_statements
from paper.table import Results
from studies.amplitude import measure
from studies.amplitude.section import CONTROLS, collect_values, list_effects
from studies.stored import read_declared

ASKED = read_declared("amplitude")
RUNS = {one["name"]: ASKED | one for one in ASKED["run"]}
OWN = [one for one in load_statements() if one.id.startswith("own-amplitude")]


def plant(gain, sets=8, seed=0):
    """Results in which the first antenna of each pair leads by a gain, by amplitude, and chance."""
    rng, found = np.random.default_rng(seed), {}
    for name, asked in RUNS.items():
        dims = {
            "set": range(sets),
            "placement": asked["placements"],
            "law": asked["noise"],
            "level": (0, 1),
            "pair": [" ".join(pair) for pair in asked["pairs"]],
            "part": ["first", *measure.AMPLITUDES],
            "classifier": measure.CLASSIFIERS,
        }
        shape = [len(values) for values in dims.values()]
        accuracy = xr.DataArray(
            0.6 + 0.02 * rng.standard_normal(shape),
            {k: list(v) for k, v in dims.items()},
            [*dims],
        )
        for part, points in gain.items():
            accuracy.loc[{"part": part}] -= points / 100
        factor = np.ones((sets, shape[1], shape[4], 3))
        found[name] = xr.Dataset(
            {
                "accuracy": accuracy,
                "factor": (("set", "placement", "pair", "amplitude"), factor),
            },
            {"amplitude": [*measure.AMPLITUDES]},
        )
    return found


@pytest.fixture(scope="module")
def touches():
    """Thirty uneven touches in few samples, learned twice, and an antenna three times as loud."""
    rng = np.random.default_rng(1)
    mean = np.cumsum(rng.standard_normal((30, 8, 20)), axis=2) * np.linspace(0.2, 2, 8)[:, None]
    labels = np.arange(30)
    made = {
        "asked": (mean + 0.1 * rng.standard_normal(mean.shape), labels),
        "learned": (
            np.concatenate([mean, mean + 0.2]) + 0.1 * rng.standard_normal((60, 8, 20)),
            np.tile(labels, 2),
        ),
    }
    return {"quiet": made, "loud": measure.multiply(made, 3.0)}


def compare(touches, law, sizes, pair=("loud", "quiet")):
    asked = ASKED | {"noise": {law: sizes}, "pairs": [pair]}
    factors = [
        [
            measure.measure_amplitude(touches[pair[0]], one)
            / measure.measure_amplitude(touches[pair[1]], one)
            for one in measure.AMPLITUDES
        ]
    ]
    cells = np.reshape(
        measure.compare(touches, factors, law, asked, 0),
        (len(sizes), 4, len(measure.CLASSIFIERS)),
    )
    return cells, factors[0]


def test_a_louder_antenna_gains_in_absolute_noise_what_less_noise_gives_and_no_more(touches):
    found, factors = compare(touches, "absolute", [6.0, 18.0])
    assert factors == pytest.approx([1.0, 3.0, 3.0])
    first, as_is, peak, rms = found.transpose(1, 0, 2)
    np.testing.assert_array_equal(first[1], as_is[0])  # 3 x in noise of 18 is x in noise of 6
    np.testing.assert_array_equal(peak, first)
    np.testing.assert_array_equal(rms, first)
    assert (first[1] > as_is[1] + 0.05).all()


def test_amplitude_is_nothing_in_relative_noise_and_something_between_in_a_receptor(touches):
    first, as_is, *_ = compare(touches, "relative", [0.3, 1.0])[0].transpose(1, 0, 2)
    np.testing.assert_array_equal(first, as_is)
    asked = {"bend_equal": 1.0}
    noise = measure.make_noise("receptor", 2.0, **asked)
    bend = np.array([0.0, 1.0, 100.0])
    np.testing.assert_allclose(noise.sd(bend), [2.0, np.sqrt(8.0), 200.0], rtol=1e-3)


def test_the_template_observer_of_known_touches_is_the_nearest_template(touches):
    met, labels = touches["quiet"]["asked"]
    known = {"learned": (met, labels), "asked": (met, labels)}
    rng, noise = np.random.default_rng(3), Common(3.0)
    told = measure.classify(known, noise, ASKED, np.random.default_rng(3))[-1]
    seen = noise.add(met, rng, ASKED["copies"])
    far = ((seen[:, None] - met) ** 2).sum(axis=(2, 3))
    assert told == np.mean(far.argmin(axis=1) == np.tile(labels, ASKED["copies"]))


def test_uniform_antennas_have_the_compliance_that_they_are_named_after():
    made = measure.make_antennas(cockroach())
    graded = made["graded"]
    arm = (graded.length - graded.hinge_position) ** 2
    for name, weight in (("total", np.ones_like(arm)), ("tip", arm)):
        assert np.ptp(made[name].stiffness) == pytest.approx(0.0)
        own, published = (np.sum(weight / one.stiffness) for one in (made[name], graded))
        assert own == pytest.approx(published)
    assert {"graded", *CONTROLS} == made.keys()


def test_what_is_planted_is_counted():
    values = collect_values(plant({"as_is": 20.0, "peak": 0.0, "rms": -20.0}))
    for law in ASKED["noise"]:
        of = values[f"amplitude.count.{law}.as_is.of"]
        assert values[f"amplitude.count.{law}.as_is.helps"] == of == 27
        assert values.get(f"amplitude.count.{law}.rms.harms") == (
            of if law != "relative" else None
        )
        assert values.get(f"amplitude.count.{law}.peak.helps", 0) <= 2
    assert (
        values["amplitude.count.null.of"] == 9
    )  # all differ, as what is planted is planted there
    assert values["amplitude.count.null.differs"] == 9
    gain = values["amplitude.gain.medium.absolute.narrow.linear.refitted.as_is"]
    assert gain["value"] == pytest.approx(20.0, abs=3.0)


@pytest.mark.long
@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_no_rule_is_met_by_planted_nothing(statement):
    for seed in range(3):
        values = collect_values(plant({}, seed=seed))
        assert statement.list_keys() <= set(values)
        assert not judge(statement, Results.make(values), "paper").holds


@pytest.mark.long
def test_a_small_run_finds_nothing_where_there_is_nothing():
    small = {"sets": 1, "train": 2, "interval": 10.0, "speed": 0.6, "tail": 20.0}
    found = measure.compute_run(cockroach(), RUNS["check"] | small)
    louder = list_effects(found).sel(pair="louder refitted")
    assert not louder.sel(part=["peak", "rms"]).any()
    assert not louder.sel(law="relative").any()
    assert float(louder.sel(law="absolute", part="as_is").mean()) > 5
