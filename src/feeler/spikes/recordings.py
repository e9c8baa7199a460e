"""Spikes of one's own: trains from CSV, NWB and Phy or Kilosort, cut into trials, measured, and
compared with the model.
"""

import ast
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.optimize import minimize
from scipy.signal import coherence
from scipy.special import xlogy

from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.files import read_start, read_text
from feeler.records import Choice, Gt, Shown
from feeler.sandbox import open_guarded
from feeler.spikes.sensilla import CAMPANIFORM, TABLE, Sensillum, encode_touch, find_step
from feeler.spikes.trains import attach_trains, count_spikes
from feeler.tables import TIME_UNITS, find_times, is_numeral, read_table, sniff_columns
from feeler.tensors.formats import HDF5, Format
from feeler.tensors.schema import label_units
from feeler.tensors.transforms import in_unit
from feeler.validation import checked

# Trains on the session's clock.

_SPIKE, _ONSET = "spike", "onset|contact|start|on"  # what times are of, in names of columns
_OWNERS = ("unit", "unit_id", "cluster", "cluster_id", "neuron", "id")
_FASTEST = 2.0  # [C] spikes per ms of one unit in the median interval, above any nerve fibre's
_MIXED = 0.02  # [C] share of a unit's intervals that may be as short
_FEW = 20  # [C] intervals that may be equal by chance or design
_KINDS = 12  # [C] whole numbers in a column that says of what kind its rows are
_SLOWEST = 2e-4  # [C] spikes per ms: one in 5 s


@checked
def read_trains(
    path: str | os.PathLike, *, unit: Annotated[str, Choice(("s", "ms", "us"))] | None = None
) -> dict[str, np.ndarray]:
    """Trains of a recording, by unit: times [ms] on the session's clock, rising.

    Parameters
    ----------
    path
        A table with a column of times (``time_s``, ``spike_time_ms``, …) and, of several units, one
        called ``unit``, ``cluster``, ``neuron`` or ``id``; an NWB file with a table ``units``; or a
        folder of Phy or Kilosort (``spike_times.npy``, ``spike_clusters.npy``, ``params.py``), of
        which clusters labelled noise are left out.
    unit
        ``s``, ``ms`` or ``us``: that of the times where the file does not say, or says it wrongly
        (NWB has s). Given, unusual intervals are not questioned.

    Raises
    ------
    InvalidInput
        None of these, no unit where it is needed, one that the column contradicts, or intervals
        that no nerve fibre has, as where seconds pass for ms.
    """
    path = Path(path)
    if path.is_dir():
        trains = _read_phy(path)
    elif read_start(path, len(HDF5)) == HDF5:
        trains = _read_nwb(path, TIME_UNITS[unit or "s"])
    else:
        trains = _read_table(path, unit, _SPIKE)
    if not trains or not any(train.size for train in trains.values()):
        raise InvalidInput(f"{path.name} holds no spike.")
    if unit is None:
        _doubt_clock(trains, path.name)
    close = {
        name: np.mean(np.diff(train) < 1 / _FASTEST)
        for name, train in trains.items()
        if train.size > _FEW
    }
    if close := {name: share for name, share in close.items() if share > _MIXED}:
        text = (
            "intervals of units are shorter than a nerve fibre's: several cells, or rows twice?"
        )
        shares = ", ".join(
            f"{name}: {share:.0%} under {1 / _FASTEST} ms" for name, share in close.items()
        )
        warnings.warn(ModelValidityWarning(text, shares + "."), stacklevel=3)
    return trains


def _doubt_clock(trains: Mapping[str, np.ndarray], source: str) -> None:
    """Refuse trains whose intervals are those of another unit of time."""
    steps = np.concatenate([np.diff(train) for train in trains.values()])
    steps = steps[steps > 0]
    if not steps.size:
        return
    usual = float(np.median(steps))
    if steps.size > _FEW and np.ptp(steps) < 1e-3 * usual:
        raise InvalidInput(
            f"{source}: its times are {usual:.4g} ms apart, all of them: these are samples of a"
            " clock and no spikes. If they are spikes, give unit=."
        )
    if not _SLOWEST < 1 / usual < _FASTEST:
        faster = 1 / usual >= _FASTEST
        raise InvalidInput(
            f"{source}: the median interval between a unit's spikes is {usual:.3g} ms, which hardly"
            f" any unit has. Are its times {'s' if faster else 'ms'}? If so, name the column"
            f" time_{'s' if faster else 'ms'}; if they are right, give unit= as it is."
        )


def _read_table(path: Path, unit: str | None, events: str) -> dict[str, np.ndarray]:
    table = read_table(path, words=_OWNERS)
    found = find_times(table.columns, events)
    if not found:
        raise InvalidInput(
            f"{path.name} has no column of times, but {', '.join(table.columns[:12])}. Spikes are"
            " a table with columns unit and time_s or time_ms, a row per spike."
        )
    if len(found) > 1:
        raise InvalidInput(
            f"{path.name}: which of {', '.join(found)} is the time? Leave one of them."
        )
    column, said = next(iter(found.items()))
    if not (said or unit):
        raise InvalidInput(
            f"{path.name}: column {column!r} does not say whether its times are s or ms; give"
            " unit='s' or unit='ms', or call it time_s."
        )
    if said and unit and TIME_UNITS[said] != TIME_UNITS[unit]:
        raise InvalidInput(
            f"{path.name}: unit={unit!r} contradicts column {column!r}. Leave unit= out, or rename"
            " the column."
        )
    time = table.column(column) * TIME_UNITS[said or unit or ""]
    owner = next((name for name in table.columns if name.lower() in _OWNERS), None)
    labels = np.full(time.size, "1") if owner is None else table.words[owner]
    if all(map(is_numeral, labels.tolist())):  # 3.0, as pandas writes it, is 3
        labels = np.array([f"{float(label):.15g}" for label in labels.tolist()])
    for name in [name for name in table.columns if name not in (owner, column)]:
        rows = pd.Series(table.words.get(name, table.values[:, table.columns.index(name)]))
        kinds = rows.unique()
        if name not in table.words and (len(kinds) > _KINDS or (rows % 1 > 0).any()):
            continue  # measured, or counted
        if rows.groupby(labels).nunique(dropna=False).max() > 1 and len(kinds) < len(rows):
            text = f"all rows of {path.name} are taken, though they differ in {name}."
            warnings.warn(
                ModelValidityWarning(text, ", ".join(map(str, kinds[:12]))), stacklevel=4
            )
    return {
        str(name): np.sort(time[(labels == name) & np.isfinite(time)])
        for name in dict.fromkeys(labels.tolist())
    }


def _read_nwb_units(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The table of units of an NWB file, for the guarded process."""
    import h5py

    with h5py.File(path, "r") as file:
        if "units/spike_times" not in file:
            raise InvalidInput("it has no table of units with spike_times.")
        ends = file["units/spike_times_index"][...]
        names = [str(one) for one in file["units/id"][...]]
        found = {"times": file["units/spike_times"][...], "ends": ends}
        if "intervals/trials/start_time" in file:
            found["starts"] = file["intervals/trials/start_time"][...] * 1e3
            found["stops"] = file["intervals/trials/stop_time"][...] * 1e3
    return {"names": names}, found


def _read_nwb(path: Path, scale: float) -> dict[str, np.ndarray]:
    about, arrays = open_guarded(f"{__name__}:_read_nwb_units", path)
    trains = np.split(arrays["times"], arrays["ends"][:-1].astype(int))
    return {
        name: np.sort(train) * scale for name, train in zip(about["names"], trains, strict=True)
    }


@checked
def read_onsets(path: str | os.PathLike, *, unit: str | None = None) -> np.ndarray:
    """When contact began in each trial [ms], on the session's clock: from a table with a column
    ``onset_s`` or ``onset_ms``, or the starts of an NWB file's trials.
    """
    if read_start(path, len(HDF5)) != HDF5:
        return np.sort(np.concatenate([*_read_table(Path(path), unit, _ONSET).values()]))
    _, arrays = open_guarded(f"{__name__}:_read_nwb_units", path)
    if "starts" not in arrays:
        raise InvalidInput(f"{Path(path).name} has no table of trials; give the onsets.")
    return np.asarray(arrays["starts"], dtype=float)


def _read_phy(folder: Path) -> dict[str, np.ndarray]:
    """Trains of a folder by Phy or Kilosort."""
    arrays = {}
    for name in ("spike_times", "spike_clusters", "spike_templates"):
        file = folder / f"{name}.npy"
        if file.exists():
            try:
                arrays[name] = np.load(file, allow_pickle=False).ravel()
            except (ValueError, OSError) as error:
                raise InvalidInput(f"{file.name} is no array of numbers: {error}.") from None
    owner = arrays.get("spike_clusters", arrays.get("spike_templates"))
    if "spike_times" not in arrays or owner is None:
        raise InvalidInput(
            f"{folder.resolve().name} is no folder of Phy or Kilosort: it lacks spike_times.npy or"
            " spike_clusters.npy."
        )
    if owner.size != arrays["spike_times"].size:
        raise InvalidInput(
            f"{folder.name}: {arrays['spike_times'].size} spike times, {owner.size} clusters."
        )
    file = folder / "params.py"
    match = (
        re.search(r"^\s*sample_rate\s*=\s*([\d.eE+]+)", read_text(file, 2**20), re.M)
        if file.exists()
        else None
    )
    if match is None:
        raise InvalidInput(
            f"{folder.name}: params.py with sample_rate is missing; times are samples."
        )
    time = arrays["spike_times"] * (1e3 / float(ast.literal_eval(match[1])))
    noise = set()
    for name in ("cluster_group.tsv", "cluster_KSLabel.tsv"):
        if (folder / name).exists():
            table = read_table(folder / name, words=("cluster_id", "group", "kslabel"))
            clusters, groups = (table.words[column] for column in table.columns[:2])
            noise = set(clusters[groups == "noise"].tolist())
            break
    return {
        str(name): np.sort(time[owner == name])
        for name in np.unique(owner).tolist()
        if str(name) not in noise
    }


# What ``feeler info`` says of such files.


def _is_spikes(path: Path, start: bytes) -> bool:
    if path.is_dir():
        return (path / "spike_times.npy").exists()
    if start.startswith(HDF5):
        return path.suffix == ".nwb"
    names = sniff_columns(start)
    if len(names) == 1:  # without those that are called onsets
        return bool(find_times(names, "spike"))
    return (
        bool(find_times(names, _SPIKE))
        and len(names) <= 4
        and any(name.lower() in _OWNERS for name in names)
    )


def _tell_spikes(path: Path, limits: Any, trusted: bool) -> list[str]:
    trains = read_trains(path)
    sizes = [train.size for train in trains.values()]
    last = max(float(train[-1]) for train in trains.values() if train.size)
    return [
        f"units       {len(trains)}: {', '.join([*trains][:12])}",
        f"spikes      {sum(sizes)}, {min(sizes)} to {max(sizes)} of a unit",
        f"last        {last / 1e3:.4g} s",
        f"next        feeler spikes --recorded {quote(path.name)} --onsets CONTACTS.csv",
    ]


SPIKE_FILES = {
    "spikes": Format(
        words="trains of spikes", kind="spikes", detect=_is_spikes, load=_tell_spikes, tell=list
    )
}


# Trials cut from a session.


@checked
def cut_trains(
    trains: Mapping[str, Any],
    onsets: Sequence[float] | np.ndarray,
    *,
    before: Annotated[float, Gt(0)] = 50.0,
    after: Annotated[float, Gt(0)] = 400.0,
    touches: xr.Dataset | None = None,
) -> xr.Dataset:
    """Trials of a session, as a Dataset with ``spike_time`` (trial, unit, event) [ms].

    Parameters
    ----------
    trains
        Times [ms] by unit on the session's clock, as :func:`read_trains` gives them.
    onsets
        When contact began in each trial [ms], on the same clock, rising.
    before, after
        What is kept around each onset [ms], without ``touches``.
    touches
        The simulated or recorded touches, one per onset, to which the trains are attached: contact
        begins at their ``lead``, or at time 0 without one.

    Returns
    -------
    Dataset
        ``touches`` with the trains; or one of its own, with ``time`` in steps of 1 ms from −before
        to ``after`` and ``lead`` 0, which is what :func:`count_spikes` and its classifiers take.

    Raises
    ------
    InvalidInput
        Onsets that do not rise, lie outside the session as where they are in s, or are other
        many than touches.
    """
    onset = np.atleast_1d(np.asarray(onsets, dtype=float))
    if onset.ndim != 1 or not onset.size or not np.all(np.diff(onset) > 0):
        raise InvalidInput("onsets must rise, one for each trial [ms].")
    times = np.concatenate([np.asarray(train, dtype=float) for train in trains.values()])
    last = float(times.max()) if times.size else 0.0
    # trials that overlap, all of them in the first hundredth of the session
    if onset.size > 1 and np.median(np.diff(onset)) < before + after and last > 100 * onset[-1]:
        raise InvalidInput(
            f"the onsets end at {onset[-1]:.4g} ms, the spikes at {last:.4g} ms: are the onsets in"
            " s? Multiply them by 1000."
        )
    if onset[0] > last:
        raise InvalidInput(
            f"the first onset, {onset[0]:.4g} ms, is after the last spike, {last:.4g} ms. Are they"
            " on the same clock, and both in ms?"
        )
    if late := int((onset > last).sum()):
        text = "trials whose contact begins after the last spike count as silent."
        warnings.warn(
            ModelValidityWarning(text, f"Of {onset.size} onsets these are the last {late}."),
            stacklevel=3,
        )
    if touches is not None:
        if touches.sizes["trial"] != onset.size:
            raise InvalidInput(
                f"{onset.size} onsets for {touches.sizes['trial']} touches; give one each."
            )
        clock = in_unit(touches["time"], "ms").values
        leads = np.broadcast_to(touches.coords.get("lead", 0.0), onset.shape)
        rows = [
            [_take(train, start - lead, clock[0], clock[-1]) for train in trains.values()]
            for start, lead in zip(onset, leads, strict=True)
        ]
        return attach_trains(touches, rows, [*trains])
    rows = [
        [_take(train, start, -before, after) for train in trains.values()] for start in onset
    ]
    clock = np.arange(-np.floor(before), np.floor(after) + 1)
    empty = xr.Dataset(
        coords={
            "time": clock,
            "trial": np.arange(onset.size),
            "lead": ("trial", np.zeros(onset.size)),
            "source": ("trial", ["recording"] * onset.size),
        }
    )
    return attach_trains(label_units(empty), rows, [*trains])


def _take(train: Any, start: float, first: float, last: float) -> np.ndarray:
    own = np.asarray(train, dtype=float) - start
    return own[(own >= first) & (own <= last)]


# What trains say.


@checked
def measure_trains(drawn: xr.Dataset) -> pd.DataFrame:
    """Rate, intervals and onset latency of each unit, a row per unit.

    Returns
    -------
    DataFrame
        ``unit``; ``spikes`` in all trials; ``rate_hz`` over the whole record; ``rate_contact_hz``
        from contact (``lead``) to the end; ``isi_ms`` and ``isi_cv``, the mean interval and its
        coefficient of variation; ``latency_ms``, the median over trials of the first spike after
        contact, and ``answered``, the share of trials that have one.
    """
    times, clock = _read_times(drawn)
    lead = _read_leads(drawn)
    length = float(clock[-1] - clock[0])
    rows = []
    for name, unit in zip(drawn["unit"].values, times.swapaxes(0, 1), strict=True):
        trains = [row[np.isfinite(row)] for row in unit]
        after = [
            train[train >= start] - start for train, start in zip(trains, lead, strict=True)
        ]
        steps = np.concatenate([np.diff(train) for train in trains])
        first = [train[0] for train in after if train.size]
        heard = float(np.sum(clock[-1] - lead))
        rows.append(
            {
                "unit": str(name),
                "spikes": sum(map(len, trains)),
                "rate_hz": 1e3 * sum(map(len, trains)) / (length * len(trains)),
                "rate_contact_hz": 1e3 * sum(map(len, after)) / heard if heard > 0 else np.nan,
                "isi_ms": steps.mean() if steps.size else np.nan,
                "isi_cv": steps.std(ddof=1) / steps.mean() if steps.size > 1 else np.nan,
                "latency_ms": float(np.median(first)) if first else np.nan,
                "answered": len(first) / len(trains),
            }
        )
    return pd.DataFrame(rows)


@checked
def compute_psth(drawn: xr.Dataset, width: Annotated[float, Gt(0)] = 10.0) -> xr.DataArray:
    """Rate of each unit over all trials (unit, time) [Hz], in bins of ``width`` [ms] from contact
    on and before it.
    """
    times, clock = _read_times(drawn)
    lead = _read_leads(drawn)
    first, last = float((clock[0] - lead).max()), float((clock[-1] - lead).min())
    edges = width * np.arange(np.ceil(first / width - 1e-9), np.floor(last / width + 1e-9) + 1)
    if edges.size < 2:
        raise InvalidInput(
            f"width {width:g} ms is longer than the {last - first:g} ms there are."
        )
    own = times - lead[:, None, None]
    counts = [np.histogram(own[:, k], edges)[0] for k in range(own.shape[1])]
    return xr.DataArray(
        1e3 * np.array(counts) / (width * len(own)),
        {"unit": drawn["unit"].values, "time": edges[:-1] + width / 2},
        ("unit", "time"),
        name="rate",
        attrs={"units": "Hz"},
    )


@checked
def measure_van_rossum(
    one: Annotated[np.ndarray, "spike"],
    other: Annotated[np.ndarray, "event"],
    tau: Annotated[float, Gt(0)] = 10.0,
) -> float:
    """Distance of two trains [ms]: the norm of their difference after each spike has become
    exp(−t/τ), over √(τ/2), so that one spike more or less is 1 (van Rossum 2001, Neural Comput
    13:751).
    """
    a, b = (np.asarray(train, dtype=float) for train in (one, other))

    def overlap(x: np.ndarray, y: np.ndarray) -> float:
        return float(np.exp(-np.abs(x[:, None] - y[None, :]) / tau).sum())

    return float(np.sqrt(max(overlap(a, a) + overlap(b, b) - 2 * overlap(a, b), 0.0)))


@checked
def compare_trains(
    model: xr.Dataset,
    recorded: xr.Dataset,
    *,
    tau: Annotated[float, Gt(0)] = 10.0,
    width: Annotated[float, Gt(0)] = 10.0,
    pairs: Mapping[str, str] | None = None,
) -> pd.DataFrame:
    """How well a model's trains agree with recorded ones, a row per recorded unit.

    Parameters
    ----------
    model, recorded
        With ``spike_time`` and the same number of trials, in the same order.
    tau
        [ms] of van Rossum's distance.
    width
        [ms] of the bins of the rates.
    pairs
        Recorded unit → unit of the model; by default the unit of the model whose rate correlates
        best, which favours the model.

    Returns
    -------
    DataFrame
        ``unit``, ``model``; ``correlation`` of the rates over time; ``distance``, van Rossum's,
        mean over trials, and ``distance_among``, that of a recorded trial from the next one, which
        no model can be expected to beat; ``coherence``, the greatest magnitude-squared coherence of
        the two rates below half the bins' rate; ``spikes`` and ``spikes_model`` per trial.
    """
    if model.sizes["trial"] != recorded.sizes["trial"]:
        raise InvalidInput(
            f"{model.sizes['trial']} trials of the model, {recorded.sizes['trial']} recorded; they"
            " must be the same touches."
        )
    rates = [compute_psth(one, width) for one in (model, recorded)]
    clocks = [np.round(rate["time"].values, 6) for rate in rates]
    common = np.intersect1d(clocks[0], clocks[1])
    if common.size < 3:
        raise InvalidInput("model and recording share less than three bins of time.")
    mine, theirs = (
        rate.values[:, np.isin(np.round(rate["time"].values, 6), common)] for rate in rates
    )
    own = {str(name): k for k, name in enumerate(model["unit"].values)}
    (times, _), (heard, _) = _read_times(model), _read_times(recorded)
    times = times - _read_leads(model)[:, None, None]
    heard = heard - _read_leads(recorded)[:, None, None]
    rows = []
    for k, name in enumerate(map(str, recorded["unit"].values)):
        fits = [_correlate(rate, theirs[k]) for rate in mine]
        if pairs is None:
            best = int(np.nanargmax(fits)) if np.isfinite(fits).any() else 0
        elif pairs.get(name) not in own:
            raise InvalidInput(f"pairs names no unit of the model for {name!r}.")
        else:
            best = own[pairs[name]]
        a, b = ([row[np.isfinite(row)] for row in one] for one in (times[:, best], heard[:, k]))
        among = [measure_van_rossum(x, y, tau) for x, y in pairwise(b)]
        n = min(64, common.size)
        both = coherence(mine[best], theirs[k], fs=1e3 / width, nperseg=max(4, n // 4))[1][1:]
        rows.append(
            {
                "unit": name,
                "model": [*own][best],
                "correlation": fits[best],
                "distance": float(
                    np.mean([measure_van_rossum(x, y, tau) for x, y in zip(a, b, strict=True)])
                ),
                "distance_among": float(np.mean(among)) if among else np.nan,
                "coherence": float(np.nanmax(both)) if np.isfinite(both).any() else np.nan,
                "spikes": float(np.mean([*map(len, b)])),
                "spikes_model": float(np.mean([*map(len, a)])),
            }
        )
    return pd.DataFrame(rows)


def _correlate(one: np.ndarray, other: np.ndarray) -> float:
    if np.ptp(one) == 0 or np.ptp(other) == 0:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])


def _read_times(drawn: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Spikes (trial, unit, event) and the clock, in ms."""
    if "spike_time" not in drawn:
        raise InvalidInput("there are no spikes; cut_trains or draw_spikes gives them.")
    times = in_unit(drawn["spike_time"], "ms").transpose("trial", "unit", "event").values
    return times, in_unit(drawn["time"], "ms").values


def _read_leads(drawn: xr.Dataset) -> np.ndarray:
    """When contact begins (trial,) [ms]."""
    lead = drawn["lead"].values if "lead" in drawn.coords else 0.0
    return np.broadcast_to(np.asarray(lead, dtype=float), (drawn.sizes["trial"],))


# A sensillum fitted to one's own unit.


@dataclass(frozen=True, kw_only=True, eq=False)
class SensillumFit(Shown):
    """A sensillum fitted to a recorded unit.

    Attributes
    ----------
    sensillum : Sensillum
        With the fitted threshold, as its offset d.
    gain, gain_interval : float, tuple
        u per unit of the stimulus, and its 95 % interval.
    threshold, threshold_interval : float, tuple
        −d [Hz]: the tonic part fires where c u exceeds it; and its 95 % interval.
    explained : float
        Share of the deviance from a constant rate that the fit explains (Cameron and Windmeijer);
        below 0 it is worse than a constant rate.
    rate : np.ndarray
        (trial, time) as fitted [Hz].
    """

    sensillum: Sensillum
    gain: float
    gain_interval: tuple[float, float]
    threshold: float
    threshold_interval: tuple[float, float]
    explained: float
    rate: np.ndarray


_FLOOR = 0.1  # [C] Hz of spontaneous spikes, below which no rate is judged
_STARTS = (
    (0.3, 0.0),
    (1.0, 41.0),
    (3.0, 41.0),
    (10.0, 120.0),
)  # [C] gain over 1/peak, threshold


@checked
def fit_sensillum(
    stimulus: Annotated[np.ndarray, "trial time"],
    recorded: xr.Dataset,
    unit: str | int,
    *,
    sensillum: Sensillum = CAMPANIFORM,
) -> SensillumFit:
    """Gain and threshold of a sensillum, fitted to the trains of one recorded unit by greatest
    likelihood of Poisson spikes; the other parameters stay those of ``sensillum``.

    Parameters
    ----------
    stimulus
        What bends the sensillum in each trial (trial, time), ≥ 0 where it can feel it: an angle
        [rad] or curvature [1/mm] at its place, or a force, on the clock of ``recorded``.
    recorded
        With ``spike_time``, as :func:`cut_trains` gives it.
    unit
        Which unit.

    Returns
    -------
    SensillumFit
        Intervals from the curvature of the log-likelihood; NaN where the data do not determine
        them.

    Raises
    ------
    InvalidInput
        Another clock, a stimulus that is never above 0, an unknown unit, or fewer than ten spikes.
    """
    names = [str(name) for name in recorded["unit"].values]
    if str(unit) not in names:
        raise InvalidInput(f"no unit {str(unit)!r}; there are {', '.join(names[:12])}.")
    counts = (
        count_spikes(recorded).transpose("unit", "trial", "time").values[names.index(str(unit))]
    )
    if stimulus.shape != counts.shape:
        raise InvalidInput(
            f"the stimulus must be on the recording's clock, shape {counts.shape}, got"
            f" {stimulus.shape}."
        )
    if counts.sum() < 10:
        raise InvalidInput(f"unit {unit} has {counts.sum()} spikes; a fit needs ten or more.")
    peak = float(stimulus.max())
    if not (np.isfinite(stimulus).all() and peak > 0):
        raise InvalidInput("the stimulus must be finite and somewhere above 0; mind its sign.")
    step = find_step(in_unit(recorded["time"], "ms").values)
    felt = np.ascontiguousarray(np.repeat(stimulus[:, :, None], 2, axis=2))

    def compute_rate(p: np.ndarray) -> np.ndarray:
        one = sensillum.replace(d=-p[1])
        table = np.array([[float(getattr(one, name))] for name in TABLE])
        rates = np.empty((*stimulus.shape, 1))
        gain = np.array([np.exp(p[0]) / peak])
        for samples, rate in zip(felt, rates, strict=True):
            encode_touch(samples, np.array([0]), np.zeros(1), gain, table, step, rate)
        return rates[:, :, 0]

    def cost(p: np.ndarray) -> float:
        expected = (compute_rate(p) + _FLOOR) * step * 1e-3
        return float(expected.sum() - xlogy(counts, expected).sum())

    ends = [
        minimize(
            cost,
            [np.log(gain), d],
            method="Nelder-Mead",
            options={"xatol": 1e-4, "fatol": 1e-6},
        )
        for gain, d in _STARTS
    ]
    best = min(ends, key=lambda end: end.fun)
    sd = _find_sd(cost, best.x)
    mean = counts.mean()
    null = float(counts.size * mean - xlogy(counts, mean).sum())
    full = float(counts.sum() - xlogy(counts, counts).sum())
    gain = float(np.exp(best.x[0]) / peak)
    spread = float(np.exp(1.96 * sd[0]))
    return SensillumFit(
        sensillum=sensillum.replace(d=-float(best.x[1])),
        gain=gain,
        gain_interval=(gain / spread, gain * spread),
        threshold=float(best.x[1]),
        threshold_interval=(best.x[1] - 1.96 * sd[1], best.x[1] + 1.96 * sd[1]),
        explained=1 - (best.fun - full) / (null - full) if null > full else float("nan"),
        rate=compute_rate(best.x),
    )


def _find_sd(cost: Any, x: np.ndarray) -> np.ndarray:
    """Standard deviations by the curvature of a cost at its minimum; NaN where it has none."""
    steps = np.diag([0.01, 0.5])
    hessian = np.empty((2, 2))
    for (j, a), (k, b) in product(enumerate(steps), repeat=2):
        four = cost(x + a + b) - cost(x + a - b) - cost(x - a + b) + cost(x - a - b)
        hessian[j, k] = four / (4 * a[j] * b[k])
    if np.any(np.linalg.eigvalsh(hessian) <= 0):
        return np.full(2, np.nan)
    return np.sqrt(np.diag(np.linalg.inv(hessian)))
