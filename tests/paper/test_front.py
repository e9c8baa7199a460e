"""The first page's accuracies: of planted touches known, of nothing at chance."""

import numpy as np
import pytest
import xarray as xr

from feeler.presets import cockroach
from feeler.tensors.schema import label_units
from paper import front
from paper.statements import load_statements
from paper.table import Results
from paper.verdicts import judge

ASKED = {
    "sets": 4,
    "train": 4,
    "copies": 2,
    "draws": 20,
    "seed": 3,
    "absolute": [0.03],
    "relative": [0.3],
    "shapes": ("ball", "box"),
    "locations": (0.5, 0.9),
}
NAMES = ("exponential", "uniform")


def make_touch(size):
    """Touches whose tensor says by one sensor each which class they are; ``size`` by antenna."""

    def touch(antenna, trials, *, duration, save, **options):
        angle = np.zeros((len(trials), 10, 30))
        for tensor, trial in zip(angle, trials, strict=True):
            kind = 2 * (trial.feature.kind == "box") + (trial.feature.size > 2.2)
            tensor[kind] = tensor[4 + (trial.location > 0.7)] = 1.0
        angle *= size[antenna.name]
        return label_units(
            xr.Dataset(
                {"angle": (("trial", "sensor", "time"), angle)},
                coords={"time": np.arange(30.0)},
            )
        )

    return touch


def find_values(monkeypatch, size):
    monkeypatch.setattr(front, "touch", make_touch(size))
    antennas = {name: cockroach(name) for name in NAMES}
    found = front.compute(antennas, {"slow": 0.06}, ASKED)
    fast = front.compute({NAMES[0]: antennas[NAMES[0]]}, {"fast": 0.6}, ASKED)
    assert found.dims == ("antenna", "speed", "set", "level", "case") and found.shape[2] == 4
    return found, front.list_values(found) | front.list_values(fast)


def judge_front(values):
    results = Results.make(values)
    return {
        one.id: judge(one, results, "paper")
        for one in load_statements()
        if one.section == "front"
    }


def test_a_larger_signal_is_classified_better_in_absolute_noise_only(monkeypatch):
    found, values = find_values(monkeypatch, {"exponential": 1.0, "uniform": 0.005})
    mean = found.mean("set").isel(speed=0)
    assert (mean.sel(antenna="exponential") > 0.9).all()
    assert (mean.sel(antenna="uniform", level="absolute 0.03") < 0.8).all()
    assert (mean.sel(antenna="uniform", level="relative 0.3") > 0.9).all()
    gradient = judge_front(values)["front-gradient"]
    held = dict(zip(gradient.statement.readings, gradient.findings[0].agrees, strict=True))
    assert all(held[name] for name in held if "absolute" in name and "ideal" not in name)
    assert not any(held[name] for name in held if "relative" in name)
    assert gradient.word == "holds under some readings only"


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_equal_antennas_and_speeds_bear_out_nothing(monkeypatch, size):
    _, values = find_values(monkeypatch, dict.fromkeys(NAMES, size))
    judged = judge_front(values)
    assert len(judged) == 2
    assert not any(agree for one in judged.values() for agree in one.findings[0].agrees)
