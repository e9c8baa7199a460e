"""Simulate spike trains.

Spikes of sensilla for touches near base, middle and tip, slow and fast.

Recordings are said to peak early, these trains peak late. So the same touches are also felt by
other sensilla, which might explain it: phasic ones, hairs, and some of the base's third alone. All
spikes are written as an array (time, trial, unit), which is what snnTorch and SpikingJelly train
networks on: ``torch.from_numpy(np.load("spikes.npz")["spikes"]).float()``.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler import Ball, Trial, touch
from feeler.plotting import plot_raster
from feeler.presets import cockroach
from feeler.spikes import CAMPANIFORM, HAIR, count_spikes, draw_spikes, place_sensilla

PLACES = {"base": 0.25, "middle": 0.55, "tip": 0.85}  # shares of the length
GAIN = 33.5  # stimulus per radian: thirty touches at 0.3 m/s reach 400 Hz in the median
SPEEDS = {"slow": 0.06, "fast": 0.6}  # m/s


def find_peak(population, touches) -> float:
    """When all units together fire most [ms after contact]; NaN where none does."""
    total = population.encode(touches)["rate"].isel(trial=0).sum("unit")
    at = float(total["time"].values[total.values.argmax()]) - float(touches["lead"][0])
    return at if total.max() > 0 else np.nan


def list_others(places) -> dict:
    """Other sensilla that might explain a peak that is early."""
    return {
        "phasic": place_sensilla(places, GAIN, sensillum=CAMPANIFORM.phasic),
        "hair": place_sensilla(places, GAIN, sensillum=HAIR),
        "third": place_sensilla(np.linspace(places[0], 0.3, 20), GAIN),
    }


def main(out: Path) -> dict[str, float]:
    antenna, found, rasters = cockroach(), {}, []
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.subplots(3, 2, sharey=True)
    for (row, (place, location)), (column, (pace, speed)) in product(
        enumerate(PLACES.items()), enumerate(SPEEDS.items())
    ):
        trial = Trial(feature=Ball(radius=1.5), location=location, speed=speed)
        touches = touch(antenna, trial, duration=float(round(20 + 24 / speed)))
        places = touches["position"].values
        population = place_sensilla(places, GAIN)
        drawn = draw_spikes(population.encode(touches), seed=1)
        late = find_peak(population, touches)
        others = {name: find_peak(one, touches) for name, one in list_others(places).items()}
        first = float(np.nanmin(drawn["spike_time"])) - trial.lead
        rasters.append(count_spikes(drawn).values[0].T)
        spikes = int(rasters[-1].sum())
        print(
            f"{place}, {pace}: {spikes} spikes, the first {first:.0f} ms after contact, most at"
            f" {late:.0f} ms, {100 * late * speed / 24:.0f} % of the way; "
            + ", ".join(f"{name} {at:.0f} ms" for name, at in others.items())
        )
        found[f"{place} {pace}"] = late * speed / 24
        ax = axes[row, column]
        side = drawn["unit_side"].values
        plot_raster(drawn["spike_time"].values[0], ax, side, trial.lead)
        ax.set_title(f"{place}, {pace}: {spikes} spikes")
    longest = max(map(len, rasters))
    padded = [np.pad(one, ((0, longest - len(one)), (0, 0))) for one in rasters]
    np.savez_compressed(out / "spikes.npz", spikes=np.stack(padded, axis=1).astype(np.uint8))
    figure.savefig(out / "listen_to_a_nerve.png", dpi=160)
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
