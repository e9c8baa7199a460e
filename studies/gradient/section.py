"""What the gradient does: bits against the stiffness rate at one total compliance (no figure of the
paper).
"""

from collections.abc import Mapping
from itertools import product
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.analysis import compute_information, find_noise, scale_peaks
from feeler.antenna.segments import Antenna
from feeler.design import match_compliance
from feeler.objects.trials import LOCATIONS
from feeler.plotting.style import pick_colours
from feeler.report import Section, make_interval
from feeler.study import Study
from feeler.tensors.transforms import in_unit
from feeler.tradeoff import UNITS_OF_NOISE, average_sets, load_declared
from paper.context import Context
from studies.stored import read_declared

_CONTACT = "contact"
_GREY = "#888888"  # of what belongs to no speed


def make_graded(
    reference: Antenna, rate: float, held: Literal["total", "tip"] = "total"
) -> Antenna:
    """Stiffness ~ exp(rate · n), with one compliance and the damping per stiffness of the
    reference.
    """
    shape = np.exp(rate * np.arange(reference.n_segments))
    return _give_stiffness(reference, match_compliance(shape, reference, held))


def _make_even(reference: Antenna, location: float) -> Antenna:
    """Even stiffness with the reference's compliance at the place of contact, Σ (x − s_n)² / k_n
    over hinges before x.
    """
    arm = np.maximum(location * reference.length - reference.hinge_position, 0.0) ** 2
    return _give_stiffness(
        reference, np.full(reference.n_segments, arm.sum() / np.sum(arm / reference.stiffness))
    )


def _give_stiffness(reference: Antenna, stiffness: np.ndarray) -> Antenna:
    return reference.replace(
        stiffness=stiffness, damping=stiffness * reference.damping / reference.stiffness
    )


def compute(
    reference: Antenna,
    asked: Mapping[str, Any],
    study: Study,
    *,
    first: int = 0,
    **options: Any,
) -> xr.Dataset:
    """Bits, accuracy, noise of 75 % accuracy and bits ``within`` a place (set, speed, rate, noise),
    and the peak angle.

    The sets are those numbered from ``first`` on.
    """
    antennas = {f"{rate:g}": [make_graded(reference, rate)] for rate in asked["rates"]}
    if asked["contact_control"]:
        antennas[_CONTACT] = [_make_even(reference, location) for location in LOCATIONS]
    shape = (asked["sets"], len(asked["speeds"]), len(antennas))
    dims, names = ("set", "speed", "rate"), ("bits", "accuracy", "noise75", "within")
    data = xr.Dataset(
        {name: ((*dims, "noise"), np.full((*shape, 2), np.nan)) for name in names}
        | {"peak": (dims, np.full(shape, np.nan))},
        {"speed": list(asked["speeds"]), "rate": list(antennas), "noise": list(UNITS_OF_NOISE)},
    )
    for number in range(asked["sets"]):
        for speed in asked["speeds"]:
            for rate, own in antennas.items():
                angle = _touch_set(own, study, first + number, speed, options)
                drawn = {"n_draws": study.draws, "random_state": first + number}
                place = {"speed": speed, "rate": rate}
                data["peak"].sel(place)[number] = np.abs(angle).max()
                for kind, values in (("relative", scale_peaks(angle)), ("common", angle)):
                    level, noise = study.headline[kind], find_noise(values, **drawn)[0]
                    known = compute_information(values, level, **drawn)
                    found = (
                        known.bits,
                        known.accuracy,
                        noise,
                        _measure_within(values, level, drawn),
                    )
                    for name, value in zip(names, found, strict=True):
                        data[name].sel(place | {"noise": kind})[number] = value
    return data


def _touch_set(
    antennas: list[Antenna], study: Study, number: int, speed: float, options: dict
) -> np.ndarray:
    """Angles of complete touches; several antennas share the places out among them."""
    trials, _ = study.task.draw(antennas[0], "test", set=number, speed=speed)
    share = len(trials) // len(antennas)
    parts = [
        study.touch(one, trials[k * share : (k + 1) * share], ("angle",), **options)
        for k, one in enumerate(antennas)
    ]
    return np.concatenate([in_unit(part["angle"], "rad").values for part in parts])


def _measure_within(values: np.ndarray, level: float, drawn: dict[str, int]) -> float:
    """Bits on the object where its place is known, mean over the places; touches come place by
    place.
    """
    parts = np.split(values, len(LOCATIONS))
    return float(np.mean([compute_information(part, level, **drawn).bits for part in parts]))


def plot(data: xr.Dataset, study: Study, figure: Figure) -> None:
    """Bits, and bits within a place, against the rate; the contact control as crosses at rate 0."""
    rates = [name for name in data["rate"].values if name != _CONTACT]
    x = np.array([float(name) for name in rates])
    order = np.argsort(x)
    colours = pick_colours(f"{speed:g} m/s" for speed in data["speed"].values)
    for row, field in zip(figure.subplots(2, 2), ("bits", "within"), strict=True):
        for ax, kind in zip(row, UNITS_OF_NOISE, strict=True):
            found = average_sets(data[field].sel(noise=kind))
            for (name, colour), speed in zip(
                colours.items(), np.sort(data["speed"].values), strict=True
            ):
                one = found.sel(speed=speed)
                line = one.sel(rate=rates)
                ax.errorbar(
                    x[order],
                    line["mean"].values[order],
                    line["half"].values[order],
                    marker=".",
                    capsize=2,
                    color=colour,
                    label=name,
                )
                if field == "within" and _CONTACT in data["rate"].values:
                    ax.plot([0.0], [float(one["mean"].sel(rate=_CONTACT))], "x", color=colour)
            ax.axvline(-0.0827, color=_GREY, ls=":", lw=0.8)
            if field == "bits":
                ax.set_title(f"noise {study.headline[kind]:g} {UNITS_OF_NOISE[kind]}")
            ax.set_ylabel("bits" if field == "bits" else "bits, place known")
            ax.set_xlabel("stiffness rate [1/joint]; < 0: softer towards the tip")
            ax.locator_params(axis="x", nbins=4)
    marks = figure.axes[0].get_legend_handles_labels()[0] + [
        Line2D([], [], color=_GREY, ls=":", label="published rate")
    ]
    if _CONTACT in data["rate"].values:
        cross = "uniform, as soft at the contact as the graded one"
        marks.append(Line2D([], [], color=_GREY, marker="x", ls="", label=cross))
    figure.legend(handles=marks, loc="outside lower center", ncols=4)


def _collect_values(data: xr.Dataset) -> dict[str, Any]:
    """The numbers that claims are held against, at the slowest speed, and (``fastest``) at the
    fastest.
    """
    found: dict[str, Any] = {}
    ends = {"": data["speed"].values.min(), "fastest.": data["speed"].values.max()}
    for rate, kind, (prefix, speed) in product(
        data["rate"].values, UNITS_OF_NOISE, ends.items()
    ):
        for part, field in (("", "bits"), ("within.", "within"), ("noise75.", "noise75")):
            one = average_sets(data[field].sel(rate=rate, noise=kind, speed=speed))
            spread = make_interval(float(one["mean"]), float(one["half"]), n=data.sizes["set"])
            found[f"gradient.{prefix}{part}{kind}.{rate}"] = spread
    return found


def show(context: Context, section: Section) -> None:
    """The dose–response, its controls, and the values."""
    asked = read_declared("gradient") | dict(context.effort.gradient)
    study = load_declared(seed=asked["seed"], draws=asked["draws"])
    data = compute(context.antenna, asked, study, **context.physics)
    section.text(
        "The antenna's stiffness is made anew with other rates at the same total compliance Σ"
        " 1/k_n, and with the damping per stiffness of each hinge as it was; touches are complete."
        " An even antenna with the same total compliance (rate 0) is the usual control; the crosses"
        " are even antennas as soft at each place of contact as the graded one is there. Those are"
        " one antenna for each place, so that the antenna itself would tell the place: this control"
        " is judged by the bits on the object where the place is known. Because the object's path"
        " is given, softness by itself changes forces more than shapes."
    )
    section.figure(
        "gradient",
        "a, b: bits of thirty touches against the gradient; c, d: bits on the object where its"
        " location is known; dotted: the published rate; crosses: uniform, with the contact's"
        f" compliance matched. Bars: 95 % CI over {study.sets} sets of resampled touches.",
        lambda figure: plot(data, study, figure),
        height=4.9,
        numbers=data.to_dict(),
    )
    columns = ("bits", "noise75", "within")
    means = {field: data[field].mean("set") for field in (*columns, "peak")}
    rows: list[list[object]] = []
    for rate, speed in product(data["rate"].values, data["speed"].values):
        here = {field: mean.sel(rate=rate, speed=speed) for field, mean in means.items()}
        told = [float(here[f].sel(noise=n)) for n in UNITS_OF_NOISE for f in columns]
        rows.append([rate, float(speed), *told, float(here["peak"])])
    header = ["rate [1/joint]", "m/s"]
    header += [
        f"{word}, {kind}"
        for kind in UNITS_OF_NOISE
        for word in ("bits", f"75 % noise [{UNITS_OF_NOISE[kind]}]", "bits, place known")
    ]
    header.append("peak [rad]")
    section.table(header, rows, f"Means over {asked['sets']} set(s).")
    section.values.update(_collect_values(data) | {"gradient.sets": data.sizes["set"]})
