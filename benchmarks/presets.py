"""Presets of other animals and robots: what they do of what was published, and what each can tell
apart.

    python benchmarks/presets.py

Writes benchmarks/results/presets.json; docs/presets.md shows it.
"""

import json
from pathlib import Path

import numpy as np
from kept import write_kept

import feeler
from feeler.analysis import find_noise, scale_peaks
from feeler.antenna import compute_base_response, compute_modes
from feeler.objects.trials import SPEEDS, trials
from feeler.presets import SPECIES, make_preset

PLANAR = (name for name in SPECIES if not make_preset(name).spatial)
NAMES = ("exponential", *PLANAR, "robot")
PUBLISHED = {
    "whisker.damping.from": 0.11,
    "whisker.damping.to": 0.17,
}  # doi:10.1523/JNEUROSCI.23-16-06510.2003
SHAKEN = np.arange(2.0, 80.0, 0.5) * 1e-3  # kHz


def measure_return(antenna) -> float:
    """Greatest swing beyond rest after a step at a quarter of the length, as a share of the first
    deflection.
    """
    held = {"at": 0.25 * antenna.length, "deflection": 0.02 * antenna.length}
    tip = feeler.release(antenna, **held, duration=400.0)["tip"].values[0, :, 0]
    return max(0.0, float(-(tip / tip[0]).min()))


def measure_shaken(antenna) -> dict[str, float]:
    """Where the tip swings most against a shaken base, how far, and how far the middle."""
    swing = abs(compute_base_response(antenna, SHAKEN) - 1)  # as seen from the base
    best = int(swing[:, -1].argmax())
    middle = int(np.searchsorted(antenna.hinge_position, antenna.length / 2))
    return {"at": 1e3 * SHAKEN[best], "tip": swing[best, -1], "middle": swing[best, middle]}


def main() -> None:
    values = {f"published.{key}": value for key, value in PUBLISHED.items()}
    values |= {f"{speed}.speed": SPEEDS[speed] for speed in ("slow", "fast")}
    for name in NAMES:
        antenna = make_preset(name)
        modes = compute_modes(antenna, 1)
        found = {
            "length": antenna.length,
            "sensors": antenna.sensors.size,
            "frequency": 1e3 * modes.frequency[0],
            "damping": modes.damping_ratio[0],
            "overshoot": 100 * measure_return(antenna),
            **{f"shaken.{key}": value for key, value in measure_shaken(antenna).items()},
        }
        for speed in ("slow", "fast"):
            angle = feeler.touch(antenna, trials((SPEEDS[speed],)))["angle"].values
            found |= {
                f"{speed}.peak": np.degrees(abs(angle).max()),
                f"{speed}.share": 100 * find_noise(scale_peaks(angle))[0],
                f"{speed}.degrees": np.degrees(find_noise(angle)[0]),
            }
        values |= {f"{name}.{key}": float(value) for key, value in found.items()}
        print(name, {key: round(float(value), 3) for key, value in found.items()}, flush=True)
    cricket = make_preset("cricket")
    critical = 2 / (2 * np.pi * compute_modes(cricket, 1).frequency[0])  # ms
    other = cricket.replace(damping=critical * cricket.stiffness)
    values |= {
        "proportional.overshoot": 100 * measure_return(other),
        "proportional.at": measure_shaken(other)["at"],
    }
    path = Path(__file__).parent / "results" / "presets.json"
    write_kept(path, json.dumps({"values": values}, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
