"""Which noise of the receptors makes the published gradient the best of its family (no figure of
the paper).
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.analysis import compute_information_known_noise, find_told
from feeler.antenna.segments import Antenna
from feeler.decoding import IdealObserver
from feeler.objects import Mixed
from feeler.plotting.style import PALETTE, mark_places, pick_shades
from feeler.report import Section, make_interval
from feeler.tensors.transforms import in_unit
from feeler.tradeoff import average_sets, load_declared
from paper.context import Context
from studies.gradient.section import make_graded
from studies.spikes.found import average, say_mean
from studies.stored import load_stored, read_declared

PUBLISHED_RATE = -0.0827  # 1/joint [P]
_SHARE = 0.95
_SEED = 0
_SIGNALS = {"sample": "the bend at that moment", "tensor": "the touch's greatest bend"}
_LINES = {
    ("main", "sample"): "0.3 m/s",
    ("fine", "sample"): "further mixtures, fresh sets, 0.3 m/s",
    ("main", "tensor"): "noise grows with the touch's greatest bend, 0.3 m/s",
    ("slow", "sample"): "0.06 m/s",
    ("tip", "sample"): "equal compliance of the tip, 0.3 m/s",
}
_SLOW, _MEDIUM = pick_shades("speed", 3)[:2]
_COLOURS = (_MEDIUM, PALETTE[1], PALETTE[2], _SLOW, PALETTE[4])
_SIZES = "sizes"  # the run of the observer that knows the size of each touch's own noise
_RUNS = (*dict.fromkeys(run for run, _ in _LINES), _SIZES)
_SHOWN = {"uniform": 0.0, "published": PUBLISHED_RATE, "steepest": -0.15}


def compute(
    reference: Antenna, names: Sequence[str] = _RUNS, **options: Any
) -> dict[str, xr.Dataset]:
    """What was declared, run by run, of those named."""
    asked = read_declared("receptor")
    return {
        one["name"]: compute_run(reference, asked | one, **options)
        for one in asked["run"]
        if one["name"] in names
    }


def compute_run(reference: Antenna, asked: Mapping[str, Any], **options: Any) -> xr.Dataset:
    """Share classified correctly (set, signal, bend, rate) by one run of those that are declared.

    ``floor`` (signal, bend) [rad] is the noise in it, at which the published antenna names
    ``accuracy`` of other sets' touches right.
    """
    study = load_declared(seed=asked["seed"], sample_interval=float(asked["interval"]))
    mixtures = list(product(asked["signals"], asked["bends"]))
    noises = [Mixed(1.0, share=1 / bend, each=signal) for signal, bend in mixtures]

    def touch(antenna: Antenna, purpose: str, number: int) -> np.ndarray:
        trials, _ = study.task.draw(antenna, purpose, set=number, speed=asked["speed"])
        return in_unit(
            study.touch(antenna, trials, ("angle",), **options)["angle"], "rad"
        ).values

    known = [touch(reference, "train", number) for number in range(asked["calibrating"])]
    drawn = {"n_draws": asked["draws"]}
    levels = [
        [
            find_told(one, noise.sd(one), asked["accuracy"], random_state=k, **drawn)
            for noise in noises
        ]
        for k, one in enumerate(known)
    ]
    floors = np.mean(levels, axis=0)
    antennas = [make_graded(reference, rate, asked["held"]) for rate in asked["rates"]]
    right = np.empty((asked["sets"], len(noises), len(antennas)))
    for row, (k, antenna) in product(range(asked["sets"]), enumerate(antennas)):
        number = asked.get("first", 0) + row
        angle = touch(antenna, "test", number)
        for cells, noise, floor in zip(right[row], noises, floors, strict=True):
            met = noise.replace(size=float(floor), share=float(floor) * noise.share)
            cells[k] = _measure(angle, met, asked, number)
    shape = (len(asked["signals"]), len(asked["bends"]))
    dims = ("set", "signal", "bend", "rate")
    return xr.Dataset(
        {
            "accuracy": (dims, right.reshape(len(right), *shape, len(antennas))),
            "floor": (dims[1:3], floors.reshape(shape)),
        },
        {"signal": list(asked["signals"]), "bend": asked["bends"], "rate": asked["rates"]},
    )


def _measure(angle: np.ndarray, noise: Mixed, asked: Mapping[str, Any], number: int) -> float:
    """Share classified correctly by the declared observer: one that knows how large the noise of
    each entry is in the mean over touches, or (``knows_sizes``) how large each touch's own is.
    """
    if not asked.get("knows_sizes"):
        found = compute_information_known_noise(
            angle, noise.sd(angle), n_draws=asked["draws"], random_state=number
        )
        return found.accuracy
    labels, copies = np.arange(len(angle)), asked["copies"]
    met = noise.add(angle, np.random.default_rng([asked["seed"], number]), copies)
    return IdealObserver(noise).fit(angle, labels).score(met, np.tile(labels, copies))


# The best of a family of rates, with intervals over sets of touches; see declared.toml.


def find_best(data: xr.Dataset, resamples: int) -> dict[str, np.ndarray]:
    """``value`` (bend,) of the best rate and the ``ends`` (2, bend) of its bootstrap interval."""
    drawn = _resample(data, resamples)
    margin = (1 - _SHARE) / 2
    return {
        "value": _find_peak(*_sort(data, data["accuracy"].mean("set").values)),
        "ends": np.quantile(drawn, (margin, 1 - margin), axis=0),
    }


def find_jump(data: xr.Dataset) -> tuple[float, float] | None:
    """The two bends [rad] between which the best rate first becomes as steep as the published one,
    or steeper; None: it never does.
    """
    steep = _find_peak(*_sort(data, data["accuracy"].mean("set").values)) <= PUBLISHED_RATE
    falls = np.flatnonzero(~steep[:-1] & steep[1:])
    bends = data["bend"].values
    return (float(bends[falls[0]]), float(bends[falls[0] + 1])) if falls.size else None


def find_lag(data: xr.Dataset) -> xr.Dataset:
    """Points that the published rate is behind the best, ± half of 95 % (bend,): chosen on sets of
    even number, judged on the others.
    """
    accuracy = 100 * data["accuracy"]
    chosen = accuracy.isel(set=slice(0, None, 2)).mean("set").argmax("rate")
    judged = accuracy.isel(set=slice(1, None, 2))
    return average_sets(judged.isel(rate=chosen) - judged.sel(rate=PUBLISHED_RATE))


def find_lead(data: xr.Dataset) -> dict[str, Any]:
    """Points that the published rate is ahead of all others, for the mixture where that is most;
    mixture and rival are chosen on sets of even number, judged on the others.
    """
    accuracy = 100 * data["accuracy"]
    lead = accuracy.sel(rate=PUBLISHED_RATE) - accuracy.drop_sel(rate=PUBLISHED_RATE)
    chosen = lead.isel(set=slice(0, None, 2)).mean("set")
    place = chosen.min("rate").argmax("bend")
    judged = lead.isel(set=slice(1, None, 2), bend=place)
    found = average_sets(judged.isel(rate=chosen.isel(bend=place).argmin("rate")))
    bend, n = float(data["bend"][place]), judged.sizes["set"]
    return {"bend": bend} | make_interval(float(found["mean"]), float(found["half"]), n=n)


def _resample(data: xr.Dataset, resamples: int) -> np.ndarray:
    """Best rates (resample, bend) of sets drawn with replacement."""
    accuracy = data["accuracy"].transpose("set", "bend", "rate").values
    rng, count = np.random.default_rng(_SEED), len(accuracy)
    weight = rng.multinomial(count, np.full(count, 1 / count), size=resamples) / count
    return _find_peak(*_sort(data, np.einsum("ns,sbr->nbr", weight, accuracy)))


def _sort(data: xr.Dataset, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(data["rate"].values)
    return data["rate"].values[order], mean[..., order]


def _find_peak(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Where y (…, place) over rising x is greatest: a parabola through three places, or an end."""
    best = y.argmax(axis=-1)
    middle = np.clip(best, 1, len(x) - 2)
    near = [np.take_along_axis(y, (middle + k)[..., None], axis=-1)[..., 0] for k in (-1, 0, 1)]
    back, on = x[middle] - x[middle - 1], x[middle] - x[middle + 1]
    fall, rise = near[1] - near[2], near[1] - near[0]
    below = back * fall - on * rise
    top = x[middle] - 0.5 * (back**2 * fall - on**2 * rise) / np.where(
        below == 0, np.inf, below
    )
    return np.where(best == middle, top, x[best])


def plot(found: Mapping[str, xr.Dataset], resamples: int, figure: Figure) -> None:
    """Accuracy against the rate for each mixture; the best rate, and what the published one loses,
    against the bend of equal noise.
    """
    (left, right), (best, lag) = figure.subplots(2, 2)
    for ax, signal in zip((left, right), _SIGNALS, strict=True):
        _plot_rates(found["main"].sel(signal=signal), ax)
        ax.set_title(f"noise grows with {_SIGNALS[signal]}")
    right.legend(
        title="equal noise at [rad]", fontsize=6.5, title_fontsize=6.5, loc="lower left"
    )
    for k, ((run, signal), label) in enumerate(_LINES.items()):
        data = found[run].sel(signal=signal)
        x = data["bend"].values * 1.05 ** (k - 2)  # beside each other, not over
        style: dict[str, Any] = {
            "color": _COLOURS[k],
            "fmt": "ovs^D"[k],
            "ms": 3.5,
            "capsize": 2,
        }
        rates = find_best(data, resamples)
        ends = np.abs(rates["ends"] - rates["value"])
        best.errorbar(x, rates["value"], ends, label=label, **style)
        lost = find_lag(data)
        lag.errorbar(x, lost["mean"], lost["half"], **style)
    best.axhline(PUBLISHED_RATE, color="#888888", ls=":")
    lag.axhline(0.0, color="#888888", ls=":")
    best.set(ylabel="best stiffness rate [1/joint]")
    lag.set(ylabel="published rate behind the best [points]")
    for ax in (best, lag):
        ax.set(xscale="log", xlabel="bend at which both noises are equal [rad]")
        mark_places(ax.xaxis, [0.0003, 0.003, 0.03, 1.0])
    handles, labels = best.get_legend_handles_labels()
    handles.append(Line2D([], [], color="#888888", ls=":"))
    figure.legend(handles, [*labels, "published rate"], loc="outside lower center", ncols=2)


def _plot_rates(data: xr.Dataset, ax: Axes) -> None:
    order = np.argsort(data["rate"].values)
    shown = average_sets(100 * data["accuracy"])
    for colour, bend in zip(pick_shades("bend", data.sizes["bend"]), data["bend"], strict=True):
        one = shown.sel(bend=bend).isel(rate=order)
        label = f"{float(bend):g}" + (" (floor)" if bend == data["bend"].max() else "")
        x = one["rate"].values
        ax.errorbar(
            x, one["mean"], one["half"], marker=".", capsize=2, color=colour, label=label
        )
    ax.axvline(PUBLISHED_RATE, color="#888888", ls=":")
    ax.set_xticks((-0.15, -0.1, -0.05, 0.0))
    ax.set(xlabel="stiffness rate [1/joint]; < 0: softer to the tip", ylabel="accuracy [%]")


def collect_values(found: Mapping[str, xr.Dataset], resamples: int) -> dict[str, Any]:
    """The numbers that claims are held against and pages print."""
    values: dict[str, Any] = {
        "receptor.published": PUBLISHED_RATE,
        "receptor.steepest": found["main"]["rate"].values.min(),
    }
    for run in found.keys() & {"main", _SIZES}:
        right = 100 * found[run]["accuracy"].sel(signal="sample")
        for bend, (word, rate) in product(right["bend"].values, _SHOWN.items()):
            spread = average(right.sel(bend=bend, rate=rate).values)
            values[f"receptor.{run}.right.{bend:g}.{word}"] = spread
    rated = {run: data for run, data in found.items() if run != _SIZES}
    for run, signal in [(run, s) for run, data in rated.items() for s in data["signal"].values]:
        data, sets = found[run].sel(signal=signal), found[run].sizes["set"]
        rates, lost = find_best(data, resamples), find_lag(data)
        for k, bend in enumerate(data["bend"].values):
            name = f"{signal}.{bend:g}"
            spread = {"low": float(rates["ends"][0, k]), "high": float(rates["ends"][1, k])}
            value = {"value": float(rates["value"][k]), **spread, "n": sets}
            values[f"receptor.{run}.best.{name}"] = value
            behind = make_interval(float(lost["mean"][k]), float(lost["half"][k]), n=sets // 2)
            values[f"receptor.{run}.behind.{name}"] = behind
            values[f"receptor.{run}.floor.{name}"] = float(data["floor"][k])
        values[f"receptor.{run}.lead.{signal}"] = find_lead(data)
        for end, bend in zip(("from", "to"), find_jump(data) or (), strict=False):
            values[f"receptor.{run}.jump.{signal}.{end}"] = bend
        gain = data["accuracy"] - data["accuracy"].sel(rate=PUBLISHED_RATE)
        half = 100 * average_sets(gain)["half"]
        values[f"receptor.{run}.typical.{signal}"] = float(half.median())
        values[f"receptor.{run}.widest.{signal}"] = float(half.max())
    return values | {f"receptor.{run}.sets": data.sizes["set"] for run, data in found.items()}


def show(context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    asked = read_declared("receptor")
    plain, said = load_stored("receptor")
    found = {name: xr.Dataset.from_dict(one) for name, one in plain.items()}
    if fresh := context.effort.questions:
        found |= compute(context.antenna, fresh, **context.physics)
        said = f"Computed in this run: {', '.join(fresh)}. {said}"
    section.text(
        "A receptor's noise may be a floor, the same at any bend, or grow with the bend (Weber), or"
        " both: sd² = floor² + (share · bend)². Both parts are equal at the bend floor / share. For"
        " each such mixture antennae are made with other stiffness rates, at the same total"
        " compliance and damping per stiffness, and an observer who knows the thirty touches names"
        " them. Every choice was written down before (studies/receptor/declared.toml)."
    )
    section.text(said)
    section.figure(
        "receptor",
        "a, b: accuracy against the stiffness rate, in noise in which that of the published antenna"
        " (dotted) is 75 %; a colour for each bend at which absolute and growing noise are equal."
        " c: the best rate of the family; d: how far the published one is behind it, against that"
        f" bend. Bars: 95 % CI over {found['main'].sizes['set']} sets of resampled touches.",
        lambda figure: plot(found, asked["resamples"], figure),
        height=5.4,
        numbers={name: data.to_dict() for name, data in found.items()},
    )
    values = collect_values(found, asked["resamples"])
    rows = [
        [run, _SIGNALS[signal], float(bend), float(data["floor"].sel(signal=signal, bend=bend))]
        + [
            _say(values[f"receptor.{run}.{part}.{signal}.{bend:g}"])
            for part in ("best", "behind")
        ]
        for run, data in found.items()
        if run != _SIZES
        for signal, bend in product(data["signal"].values, data["bend"].values)
    ]
    header = ["run", "noise grows with", "equal noise at [rad]", "floor [rad a sample]"]
    header += ["best rate [1/joint]", "published behind it [points]"]
    section.table(header, rows, "In brackets 95 % over sets.")
    bends = found["main"]["bend"].values
    section.table(
        ["equal noise at [rad]"]
        + [f"{word}, {who}" for who in ("mean", "each touch's own") for word in _SHOWN],
        [
            [float(bend)]
            + [
                say_mean(values[f"receptor.{run}.right.{bend:g}.{word}"])
                for run in ("main", _SIZES)
                for word in _SHOWN
            ]
            for bend in bends
        ],
        "Classified correctly [%] with three antennas of the family, by the observer that knows the"
        " mean size of the noise, and by one that knows the size of each touch's own noise: where"
        " noise grows with the bend, it tells of the touch by itself. ± is half the 95 %"
        " confidence interval over sets.",
    )
    section.values.update(values)


def _say(spread: Mapping[str, float]) -> str:
    ends = f" ({spread['low']:.3g}…{spread['high']:.3g})" if "low" in spread else ""
    return f"{spread['value']:.3g}{ends}"
