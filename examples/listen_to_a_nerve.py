"""What the nerve says: spikes of touches near base, middle and tip, slow and fast.

The same spikes are written as an array (time, trial, unit), which is what snnTorch and SpikingJelly
train networks on: ``torch.from_numpy(np.load("spikes.npz")["spikes"]).float()``.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler import Ball, Trial, touch
from feeler.plotting import plot_raster
from feeler.presets import cockroach
from feeler.spikes import count_spikes, draw_spikes, place_sensilla

PLACES = {"base": 0.25, "middle": 0.55, "tip": 0.85}  # shares of the length
GAIN = 33.5  # stimulus per radian: thirty touches at 0.3 m/s reach 400 Hz in the median
SPEEDS = {"slow": 0.06, "fast": 0.6}  # m/s


def main(out: Path) -> dict[str, float]:
    antenna, found = cockroach(), {}
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.subplots(3, 2, sharey=True)
    for (row, (place, location)), (column, (pace, speed)) in product(
        enumerate(PLACES.items()), enumerate(SPEEDS.items())
    ):
        trial = Trial(feature=Ball(radius=1.5), location=location, speed=speed)
        touches = touch(antenna, trial, duration=float(round(20 + 24 / speed)))
        population = place_sensilla(touches["position"].values, GAIN)
        drawn = draw_spikes(population.encode(touches), seed=1)
        total = drawn["rate"].isel(trial=0).sum("unit")
        late = float(total["time"].values[total.values.argmax()]) - trial.lead
        first = float(np.nanmin(drawn["spike_time"])) - trial.lead
        raster = count_spikes(drawn)
        spikes = int(raster.sum())
        print(
            f"{place}, {pace}: {spikes} spikes, the first {first:.0f} ms after contact, most at"
            f" {late:.0f} ms, {100 * late * speed / 24:.0f} % of the way"
        )
        found[f"{place} {pace}"] = late * speed / 24
        ax = axes[row, column]
        side = drawn["unit_side"].values
        plot_raster(drawn["spike_time"].values[0], ax, side, trial.lead)
        ax.set_title(f"{place}, {pace}: {spikes} spikes")
    np.savez_compressed(
        out / "spikes.npz", spikes=raster.transpose("time", "trial", "unit").values.astype(np.uint8)
    )
    figure.savefig(out / "listen_to_a_nerve.png", dpi=160)
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
