"""Fig. 2E and Fig. S3: the tactile tensors of every profile, and how long each touch lasts."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler import save
from feeler.objects.trials import SPEEDS
from feeler.plotting.tensors import plot_tensor_grid
from feeler.report.page import Section
from feeler.tensors.transforms import in_unit
from paper.context import Context
from paper.data import list_profiles, load_complete, load_tensors, select_speed
from paper.window import measure_window


def _select(tensors: xr.Dataset, speed: float) -> list[list[xr.DataArray]]:
    """Curvature [1/mm] of one speed: rows of locations (middle to tip), columns of features."""
    at_speed = in_unit(tensors["curvature"], "1/mm").sel(
        trial=np.isclose(tensors["speed"], speed)
    )
    columns = sorted(
        {
            (str(f), float(s))
            for f, s in zip(at_speed["feature"].values, at_speed["size"].values, strict=True)
        }
    )
    rows = sorted(set(at_speed["location"].values.tolist()))
    return [
        [
            at_speed.isel(
                trial=int(
                    np.flatnonzero(
                        np.isclose(at_speed["location"], row)
                        & (at_speed["feature"].values == feature)
                        & np.isclose(at_speed["size"], size)
                    )[0]
                )
            )
            for feature, size in columns
        ]
        for row in rows
    ]


def plot(tensors: xr.Dataset, speed: float, figure: Figure, limit: float | None = None) -> None:
    """All tensors of one speed: rows locations, columns features, one colour scale (Fig. 2E, Fig.
    S3).
    """
    grid = _select(tensors, speed)
    values = [[tensor.values for tensor in row] for row in grid]
    limit = limit or max(float(np.max(value)) for row in values for value in row)
    ax = figure.subplots()
    rows = [f"{row[0]['location'].item():g} L" for row in grid]
    columns = [f"{tensor['feature'].item()} {tensor['size'].item():g} mm" for tensor in grid[0]]
    image = plot_tensor_grid(
        values, in_unit(tensors["time"], "ms").values, ax, Normalize(0.0, limit), rows, columns
    )
    ax.set(xlabel="time [ms]", ylabel="sensor (base → tip upwards), by location of contact")
    figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)", pad=0.01)


def show(context: Context, section: Section) -> None:
    """A picture of each profile's slow tensors, and peaks of all."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets.values()))["angle"]
    _draw_sets(section, sets)
    _tabulate(
        section, sets, {name: measure_window(load_complete(context, name)) for name in sets}
    )
    slow = select_speed(next(iter(sets.values())), SPEEDS["slow"])["angle"].values
    section.values |= {
        "tensors.count": int(first.sizes["trial"]),
        "tensors.sensors": int(first.sizes["sensor"]),
        "tensors.samples": int(first.sizes["time"]),
        "tensors.negative_energy_slow": _negative_share(slow),
    }


def _draw_sets(section: Section, sets: dict) -> None:
    slow = {name: select_speed(tensors, SPEEDS["slow"]) for name, tensors in sets.items()}
    limit = max(float(in_unit(tensors["curvature"], "1/mm").max()) for tensors in slow.values())
    for name, tensors in sets.items():
        figure_name = "fig2e" if name == next(iter(sets)) else "figS3"
        where = "Fig. 2E and Fig. S3" if figure_name == "fig2e" else "Fig. S3"
        section.figure(
            f"{figure_name}_{name}",
            f"Curvature over time at slow touch (0.06 m/s), profile '{name}'. Rows: locations from"
            " the middle to the tip; columns: features. One colour scale for all profiles."
            f" ({where})",
            lambda figure, tensors=tensors: plot(tensors, SPEEDS["slow"], figure, limit),
            height=4.6,
        )
        save(slow[name], section.folder / f"{figure_name}_{name}.nc")


def _tabulate(section: Section, sets: dict, windows: dict[str, Any]) -> None:
    rows = []
    for name, tensors in sets.items():
        for speed in np.unique(tensors["speed"].values)[::-1]:
            chosen = select_speed(tensors, speed)
            peak = in_unit(chosen["angle"], "deg").max(("sensor", "time")).values
            cut = windows[name].cut if np.isclose(speed, SPEEDS["slow"]) else "–"
            rows.append(
                [
                    name,
                    speed,
                    peak.min(),
                    peak.max(),
                    in_unit(chosen["curvature"], "1/mm").max().item(),
                    cut,
                    peak.size,
                ]
            )
    section.table(
        [
            "profile",
            "speed [m/s]",
            "peak angle, least [°]",
            "largest [°]",
            "peak curvature [1/mm]",
            "cut by the window",
            "trials",
        ],
        rows,
        "Peaks over sensors and time. Cut by the window: slow touches that go on, or begin again,"
        " after it, in a run of twice its length.",
    )


def _negative_share(angle: np.ndarray) -> float:
    return float(np.sum(np.minimum(angle, 0) ** 2) / np.sum(angle**2))
