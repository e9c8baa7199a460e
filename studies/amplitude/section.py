"""When a stiffness gradient helps, and whether it is more than a larger signal (no figure of the
paper).
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.plotting.results import plot_spreads
from feeler.plotting.style import PALETTE
from feeler.report import Section
from paper.context import Context
from studies.amplitude.measure import AMPLITUDES, CLASSIFIERS
from studies.spikes.found import average, say_mean
from studies.stored import load_stored, read_declared

CONTROLS = {
    "refitted": "refitted to the calibration",
    "total": "equal total compliance",
    "tip": "equal tip compliance",
}
"""The uniform antennas that the graded one is compared with."""
_EQUAL = {"as_is": "as they are", "peak": "equal peak", "rms": "equal r.m.s."}
_TITLES = {
    "linear": "linear classifier",
    "smoothed": "after smoothing",
    "template": "template observer",
}
_PLACES = {"known": "known", "narrow": "held out", "wide": "held out, wide"}
_SHOWN = "graded refitted"
_AT = ("law", "placement", "classifier", "pair")


def list_effects(data: xr.Dataset) -> xr.DataArray:
    """Accuracy of the first antenna of a pair less the second's [points], averaged over the sizes
    of the noise (set, placement, law, pair, part, classifier).
    """
    right = 100 * data["accuracy"].mean("level")
    return right.sel(part="first", drop=True) - right.sel(part=list(AMPLITUDES))


def collect_values(found: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    """The numbers that claims are held against: gains [points], accuracy [%], the factors that make
    amplitudes equal, and in how many conditions the graded antenna helps or harms.
    """
    asked = read_declared("amplitude")
    values: dict[str, Any] = {"amplitude.sets": found["medium"].sizes["set"]}
    for run, data in found.items():
        gains, right = list_effects(data), 100 * data["accuracy"].mean("level")
        for place in product(*(data[name].values for name in _AT)):
            name, at = _name(run, *place), dict(zip(_AT, place, strict=True))
            for part in _list_parts(at["law"]):
                gain = average(gains.sel(at).sel(part=part).values)
                values[f"amplitude.gain.{name}.{part}"] = gain
            for part in ("first", "as_is") if at["pair"] == _SHOWN else ():
                share = average(right.sel(at).sel(part=part).values)
                values[f"amplitude.right.{name}.{part}"] = share
        for pair, part in product(data["pair"].values, AMPLITUDES[1:]):
            factor = data["factor"].sel(pair=pair, amplitude=part).mean("placement")
            values[f"amplitude.factor.{run}.{_name_pair(pair)}.{part}"] = average(factor.values)
    least, medium = asked["least"], list_effects(found["medium"])
    for law, part in [(name, part) for name in asked["noise"] for part in _list_parts(name)]:
        cells = medium.sel(law=law, part=part).stack(cell=("placement", "classifier", "pair"))
        shown = [average(cells.isel(cell=k).values) for k in range(cells.sizes["cell"])]
        values[f"amplitude.count.{law}.{part}.of"] = len(shown)
        values[f"amplitude.count.{law}.{part}.helps"] = sum(x["low"] > least for x in shown)
        values[f"amplitude.count.{law}.{part}.harms"] = sum(x["high"] < -least for x in shown)
    return values | _check(found["check"], values)


def _check(data: xr.Dataset, values: Mapping[str, Any]) -> dict[str, float]:
    """What must be nothing: conditions in which an antenna differs from itself, and by how much at
    most [points] the louder antenna differs from the refitted one in noise as much smaller.
    """
    start, end = "amplitude.gain.check.", ".again.as_is"
    null = [x for key, x in values.items() if key.startswith(start) and key.endswith(end)]
    louder = data["accuracy"].sel(law="absolute", pair="louder refitted")
    first, plain = louder.sel(part="first"), louder.sel(part="as_is")
    exact = abs(first.isel(level=-1) - plain.isel(level=0)).max()
    left = abs(list_effects(data).sel(pair="louder refitted", part=list(AMPLITUDES[1:]))).max()
    return {
        "amplitude.count.null.of": len(null),
        "amplitude.count.null.differs": sum(not x["low"] <= 0 <= x["high"] for x in null),
        "amplitude.gain.exact": 100 * float(exact),
        "amplitude.gain.left": float(left),
    }


def _list_parts(law: str) -> tuple[str, ...]:
    """What can be made equal, and changes something, in the noise of a law."""
    return AMPLITUDES[:1] if law == "relative" else AMPLITUDES


def _name(*place: str) -> str:
    """Run, noise, placement, classifier and pair as part of the name of a value."""
    return ".".join((*place[:-1], _name_pair(place[-1])))


def _name_pair(pair: str) -> str:
    """A pair by the antenna that only it has."""
    first, second = pair.split()
    return second if first == "graded" else first


def plot(values: Mapping[str, Any], figure: Figure) -> None:
    """Gains by placement: a row for each classifier, a column for each law of noise."""
    laws = list(read_declared("amplitude")["noise"])
    axes = figure.subplots(len(CLASSIFIERS), len(laws), sharex=True, sharey=True)
    marks: dict[str, Any] = dict(zip(AMPLITUDES, ("o", "v", "s"), strict=True))
    shifts = np.linspace(-0.32, 0.32, len(CONTROLS) * len(AMPLITUDES))
    for (row, classifier), (column, law) in product(enumerate(CLASSIFIERS), enumerate(laws)):
        ax = axes[row, column]
        for k, (part, (control, colour)) in enumerate(
            product(AMPLITUDES, zip(CONTROLS, PALETTE, strict=False))
        ):
            if part in _list_parts(law):
                names = [
                    f"amplitude.gain.medium.{law}.{place}.{classifier}.{control}.{part}"
                    for place in _PLACES
                ]
                style = {"fmt": marks[part], "ms": 3.5, "capsize": 1.5, "color": colour}
                style["mfc"] = colour if part == "as_is" else "none"
                at = np.arange(len(_PLACES)) + shifts[k]
                plot_spreads(ax, at, [values[name] for name in names], label="", **style)
        ax.axhline(0.0, color="#888888", lw=0.8)
        ax.set_xticks(range(len(_PLACES)), _PLACES.values())
        if not row:
            ax.set_title(f"{law} noise")
        if not column:
            ax.set_ylabel(f"{_TITLES[classifier]}\ngain [points]")
    handles = [
        Line2D([], [], color=colour, marker="o", ls="", label=f"{words} (uniform)")
        for colour, words in zip(PALETTE, CONTROLS.values(), strict=False)
    ]
    handles += [
        Line2D([], [], color="black", marker=marks[part], ls="", mfc=fill, label=words)
        for (part, words), fill in zip(_EQUAL.items(), ("black", "none", "none"), strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


def show(_context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    plain, said = load_stored("amplitude")
    values = collect_values({run: xr.Dataset.from_dict(one) for run, one in plain.items()})
    asked = read_declared("amplitude")
    section.text(
        "A uniform antenna bends less than the graded one, so that the same noise hides more of its"
        " signal. How much of what the gradient gains is left if the uniform antenna's tensors are"
        " multiplied by one number, so that their peak or their root mean square is the graded"
        " one's? What is left is geometry. Every choice was written down before"
        " (studies/amplitude/declared.toml)."
    )
    section.text(
        f"{said} {asked['sets']} sets of thirty touches, all resampled. Checks: an antenna differs"
        f" from itself in {values['amplitude.count.null.differs']} of"
        f" {values['amplitude.count.null.of']} conditions; an antenna whose signal is multiplied by"
        f" {asked['louder']:g} equals itself in noise as much smaller to"
        f" {values['amplitude.gain.exact']:g} points, and at equal amplitude"
        f" {values['amplitude.gain.left']:g} points are left."
    )
    section.figure(
        "amplitude",
        "Accuracy of the graded antenna less that of three uniform ones, 0.3 m/s, touches that are"
        " known or held out. Open marks: the uniform antenna's tensors multiplied so that their"
        " peak or root mean square is the graded one's, which changes nothing in relative noise."
        f" Bars: 95 % CI over {asked['sets']} sets of resampled touches.",
        lambda figure: plot(values, figure),
        height=6.0,
        numbers=plain,
    )
    header = ["noise", "touches", "classifier", "graded [%]", "uniform, refitted [%]"]
    header += [f"gain, {equal} [points]" for equal in _EQUAL.values()]
    for run, words in (("medium", "0.3 m/s"), ("slow", "0.06 m/s")):
        cells = product(asked["noise"], plain[run]["coords"]["placement"]["data"], CLASSIFIERS)
        rows = [
            [law, _PLACES[placement], _TITLES[classifier]]
            + [
                say_mean(values[key]) if key in values else "the same"
                for key in _list_keys(run, law, placement, classifier)
            ]
            for law, placement, classifier in cells
        ]
        section.table(
            header,
            rows,
            f"The uniform antenna refitted to the calibration, {words}; ± is half the 95 %"
            " confidence interval over sets.",
        )
    section.values.update(values)


def _list_keys(*place: str) -> list[str]:
    """Accuracy of both antennas, and gains."""
    name = _name(*place, _SHOWN)
    parts = [f"right.{name}.{part}" for part in ("first", "as_is")]
    parts += [f"gain.{name}.{part}" for part in AMPLITUDES]
    return [f"amplitude.{part}" for part in parts]
