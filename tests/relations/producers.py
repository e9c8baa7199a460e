"""Everything that gives users numbers, found in feeler's own registries where there is one."""

import inspect
import io
import json
import pickle
import sys
import tempfile
import time
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure
from sklearn.base import clone

import feeler
import feeler.robot
from feeler import analysis, decoding, encoding, plotting, spikes, tensors
from feeler.calibration.problem import Protocol
from feeler.plotting.antennas import describe_turnable
from feeler.robot.stream import read_samples
from feeler.studio.session import Session
from tests.cli._command import run
from tests.relations.changes import build
from tests.relations.relation import Answer, Producer, flatten, read_json
from tests.relations.worlds import World, learn_robot, make_touches
from tests.studio._messages import unpack


def label(values: Any, *dims: str) -> xr.DataArray:
    return xr.DataArray(np.asarray(values), dims=dims)


# ---- touches -----------------------------------------------------------------------------------


@cache
def touch(world: World) -> xr.Dataset:
    """All quantities of a scene, as far as its engine knows them."""
    more = [name for name, q in tensors.QUANTITIES.items() if q.make]
    return feeler.touch(world.antenna, list(world.trials), save=more, **world.options)


def take_quantities(dataset: xr.Dataset) -> Answer:
    """Every quantity of a Dataset; but seeds belong to places in a set, and a base has words."""
    left_out = ("seed", "base")
    names = [n for n in tensors.QUANTITIES if n in dataset.variables and n not in left_out]
    found = {name: dataset[name].reset_coords(drop=True) for name in names}
    return found | {f"{n} unit": str(dataset[n].attrs.get("units", "")) for n in names}


def draw_picture(dataset: xr.Dataset) -> Answer:
    """What a picture of each touch shows: its greatest number, and that of its colour scale."""
    rows = []
    for k in range(dataset.sizes["trial"]):
        plotting.plot_touch(dataset.isel(trial=[k]), figure := Figure())
        image = figure.axes[0].images[0]
        rows.append(
            [np.abs(np.asarray(image.get_array())).max(), np.abs(image.get_clim()).max()]
        )
    return {"picture": label(rows, "trial", "shown")}


def draw_turnable(world: World) -> Answer:
    """The view that is turned by hand, at the times that two samplings share."""
    dataset = feeler.touch(world.antenna, [world.trials[0]], all_hinges=True, **world.options)
    found = describe_turnable(world.antenna, world.trials[0], dataset)
    return {name: label(found[name], "frame", *"ab"[: np.ndim(found[name]) - 1])
            for name in ("time", "points", "shift")}  # fmt: skip


def ask_touch(world: World) -> Answer:
    """``feeler touch --json`` for the first touch; a peak may carry its side's sign."""
    trial = world.trials[0]
    words = ["--feature", trial.feature.kind, "--size", trial.feature.radius]
    words += ["--antenna", "it.toml", "--duration", world.options["duration"]]
    for name in ("location", "speed", "approach", "side", "friction"):
        words += [f"--{name}", getattr(trial, name)]
    words += ["--no-movie", "--json"]
    with tempfile.TemporaryDirectory() as folder:
        feeler.save_antenna(world.antenna, Path(folder, "it.toml"))
        said = read_json(run("touch", *map(str, words), cwd=folder))
    return {k: abs(v) if isinstance(v, float) else v for k, v in said.items() if k != "touch"}


# ---- simulations in the hand -------------------------------------------------------------------

GIVEN = {"objects", "names"}  # what a simulation was made of
SHOWS = [
    name
    for name, item in inspect.getmembers(feeler.Simulation)
    if isinstance(item, property) and name not in GIVEN
]
BY_OBJECT = ("place", "forward", "force", "work.objects")


@cache
def drive(world: World) -> feeler.Simulation:
    simulation = build(world)
    return world.drive(simulation) or simulation


def read_shown(world: World) -> Answer:
    """Every property of a simulation, and its fields where it has some."""
    simulation, found = drive(world), {}
    for name in SHOWS:
        value = getattr(simulation, name)
        parts = {name: value}
        if hasattr(value, "__dataclass_fields__"):
            parts = {f"{name}.{key}": getattr(value, key) for key in value.__dataclass_fields__}
        for key, item in parts.items():
            dims = ("object" if key in BY_OBJECT else "row", "axis")
            found[key] = label(item, *dims[: np.ndim(item)])
    order = np.argsort(found["contacts.place"].values)  # contacts by where they are
    return {
        name: item[order] if name.startswith("contacts.") else item
        for name, item in found.items()
        if name != "contacts.object"
    }


# ---- arrays of touches -------------------------------------------------------------------------

FEW = {"cnn": {"max_epochs": 2, "device": "cpu"}, "stream": {"window": 40, "max_lag": 3}}


def measure_index(name: str, world: World) -> Answer:
    index, scaled = analysis.INDICES[name], (world.ask / abs(world.clean).max()).values
    more = {"data_range": (-1.5, 1.5)} if index.needs_range else {}
    every = slice(0, len(scaled))
    return {name: label(index.make(scaled, **more)(every, every), "trial", "other trial")}


def ask_classifier(name: str, world: World) -> Answer:
    """What a classifier says of touches, one by one, from tensors with noise that it knows."""
    make = decoding.CLASSIFIERS[name]
    known = FEW.get(name, {})
    told = getattr(make, "knows_noise", False)
    classifier = make(**known, **({"noise": f"common:{world.noise!r}"} if told else {}))
    return decide(classifier, world.clean if told else world.learn, world)


def decide(classifier: Any, learn: xr.DataArray, world: World) -> Answer:
    classifier.fit(learn.values, learn["label"].values.tolist())
    return {"probability": label(classifier.predict_proba(world.ask.values), "trial", "class")}


@cache
def fit_encoder(sparseness: float | None = 0.7) -> encoding.ConvolutiveNMF:
    how = {"n_lags": 10, "n_restarts": 1, "max_iter": 15, "random_state": 0, "warn": False}
    encoder = encoding.ConvolutiveNMF(3, sparseness=sparseness, **how)
    return encoder.fit(tensors.rectify(make_touches().clean).values)


def encode_touches(code: str, world: World) -> Answer:
    found = fit_encoder().transform(abs(world.ask).values, code=code)
    scale = float(abs(world.clean).max())
    return {code: label(found / scale, "trial", "component", "time")}


def describe_noise(name: str, world: World) -> Answer:
    """The level of a noise over the greatest magnitude of all touches."""
    model = decoding.NOISES[name]
    noise = model(size=0.1 if model.is_share and name != "common" else world.noise)
    level = np.broadcast_to(noise.sd(world.ask.values), world.ask.shape)
    return {name: label(level / np.abs(world.clean.values).max(), "trial", "sensor", "time")}


PAIRS = ("trial", "other trial")
MEASURES = {
    "compute_information": lambda x, sd: vars(analysis.compute_information(x, sd)),
    "compute_information_known_noise": lambda x, sd: vars(
        analysis.compute_information_known_noise(x, np.full((len(x), 1, 1), sd))
    ),
    "find_noise": lambda x, sd: np.array(analysis.find_noise(x)) / sd,
    "find_told": lambda x, sd: analysis.find_told(x, np.full((len(x), 1, 1), sd)),
    "compute_energy": lambda x, sd: label(analysis.compute_energy(x / sd), *PAIRS),
    "compute_energies": lambda x, sd: label(
        analysis.compute_energies(x / sd, [20, 60]), "end", *PAIRS
    ),
    "compute_fisher": lambda x, sd: analysis.compute_fisher(x[:3], sd),
    "scale_peaks": lambda x, sd: label(analysis.scale_peaks(x), "trial", "sensor", "time"),
}
"""Information measures; none has a registry, so that what is new is asked for by name."""


def measure(name: str, world: World) -> Answer:
    found = MEASURES[name](world.clean.values, world.noise)
    return dict(found) if isinstance(found, dict) else {name: found}


def ask_spikes(code: str, world: World) -> Answer:
    if code == "poisson":
        return decide(spikes.PoissonObserver(step=1.0, floor=0.1), world.clean, world)
    return decide(spikes.SpikeClassifier(code, width=5), world.learn, world)


# ---- Datasets ----------------------------------------------------------------------------------


def group(world: World) -> Answer:
    """The encoders' input: groups of touches in one order, on one scale."""
    found = decoding.list_groups({"exponential": world.dataset})
    return {
        f"{c} {g}": values for c, groups in found.items() for g, (values, _) in groups.items()
    }


def answer_file(command: str, world: World, *words: str) -> Answer:
    with tempfile.TemporaryDirectory() as folder:
        feeler.save(world.dataset, Path(folder, "set.nc"))
        files = ["--touches"] * (command == "spikes") + ["set.nc"]
        return read_json(run(command, *files, *words, "--json", cwd=folder))


def excite(world: World) -> Answer:
    """Rates of sensilla on both sides together."""
    places = world.dataset["position"].values
    rates = spikes.place_sensilla(places, 5.0).encode(world.dataset)["rate"]
    return {"rate": rates.sum("unit").reset_coords(drop=True)}


# ---- bases -------------------------------------------------------------------------------------

BASES = {
    "similarity": lambda a, b: label(
        encoding.compute_basis_similarity(a, b), "component", "other"
    ),
    "location": lambda a, b: label(encoding.locate_components(a), "component"),
    "matched": lambda a, b: label(encoding.match_components(a, b)[1], "component"),
    "stability": lambda a, b: encoding.compute_stability([a, b]),
}


def compare_bases(name: str, world: World) -> Answer:
    return {name: BASES[name](world.first.values, world.second.values)}


# ---- films -------------------------------------------------------------------------------------


def write_film(world: World, path: Path) -> None:
    """A film as a plain table, or as DeepLabCut writes the tracks of one animal or of two."""
    n, table = len(world.columns["head"]), {}
    if world.clock != "option":
        table[world.clock] = (
            np.arange(n) / world.rate * (1 if world.clock == "time_s" else 1000)
        )
    if world.form == "plain":
        table |= {
            f"{k}_{c}": v
            for k, xy in world.columns.items()
            for c, v in zip("xy", xy.T, strict=True)
        }
        return pd.DataFrame(table).to_csv(path, index=False, float_format="%.10g")
    for who in ("a0", "a1") if world.form == "two animals" else ("a0",):
        for name, xy in world.columns.items():
            lost = np.isnan(xy[:, 0]) & (who == "a0")
            shown = np.nan_to_num(xy) if who == "a0" else xy[::-1] + 40
            columns = (*shown.T, np.where(lost, 0.1, 0.99))
            for coord, column in zip(("x", "y", "likelihood"), columns, strict=True):
                table["net", who, name, coord] = column
    found = pd.DataFrame(table)
    found.columns.names = ["scorer", "individuals", "bodyparts", "coords"]
    if world.form == "dlc":
        found = found.droplevel("individuals", axis=1)
    return found.to_csv(path, float_format="%.10g")


def ask_tracks(world: World) -> Answer:
    """``feeler tracks --json`` for a film, in the form that it has."""
    with tempfile.TemporaryDirectory() as folder:
        files, words = ["film.csv"], [*world.options]
        write_film(world, Path(folder, "film.csv"))
        if world.clock == "option":
            words += ["--frame-rate", str(world.rate)]
        if world.form == "two animals":
            words += ["--individual", "a0"]
        if world.through == "two files":
            write_film(world, Path(folder, "other.csv"))
            files.append("other.csv")
        if world.through == "nwb":  # which keeps the rate, and how it was measured
            start = "2026-05-01T09:00:00+02:00"
            more = ["--out", "out", "--session-start", start]
            read_json(run("tracks", *files, *words, *more, "--json", cwd=folder))
            files, words = ["out/tracks.nwb"], []
        return read_json(run("tracks", *files, *words, "--json", cwd=folder))


def ask_release(world: World) -> Answer:
    """``feeler calibrate --data --json``."""
    columns = dict(world.columns)
    time_ms = columns.pop("time")
    clock = time_ms / {"time_ms": 1.0, "time_s": 1000.0, "frame": 0.5}[world.clock]
    rows = np.column_stack([clock, *columns.values()])
    text = "\n".join(",".join(f"{v:.12g}" for v in row) for row in rows)
    words = ["--data", "film.csv", "--release", "first"]
    words += ["--frame-rate", "2000"] if world.clock == "frame" else []
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "film.csv").write_text(f"{','.join([world.clock, *columns])}\n{text}\n")
        found = read_json(run("calibrate", *words, "--json", cwd=folder))
    return {k: v for k, v in found.items() if k.startswith(("p.", "p[", "low", "high"))}


def ask_wall(world: World) -> Answer:
    words = ["--near", "10", "--far", "12", "--steps", "2", "--json"]
    with tempfile.TemporaryDirectory() as folder:
        return read_json(run("wall", *world.names, *words, cwd=folder))


# ---- encoders ----------------------------------------------------------------------------------


def learn(world: World) -> Answer:
    """How well an encoder explains what it learned from, after calls in this order."""
    known = tensors.rectify(make_touches().clean).values
    encoder = clone(fit_encoder())
    for call in world.calls:
        if call in ("fit", "partial_fit", "fit_stream"):
            getattr(encoder, call)(known)
        elif call == "pickle":
            encoder = pickle.loads(pickle.dumps(encoder))
        else:
            with tempfile.TemporaryDirectory() as folder:
                path = encoding.save_encoder(encoder, Path(folder, "it"))
                encoder = encoding.load_encoder(path, trusted=True)
    stale = [  # what is there belongs to the bases as they are now
        name
        for name in ("activations_",)
        if hasattr(encoder, name)
        and not np.isclose(
            np.linalg.norm(
                known - encoding.reconstruct(encoder.components_, encoder.activations_)
            )
            / np.linalg.norm(known),
            encoder.relative_residual_,
            rtol=1e-3,
        )
    ]
    return {"score": float(encoder.score(known)), "stale": str(stale)}


# ---- boards, animals, studio -------------------------------------------------------------------


def listen(world: World) -> Answer:
    """Times and values of samples as they arrive."""
    found = list(read_samples([*world.before, *world.lines], 3))[len(world.before) :]
    return {
        "time": np.array([t for t, _ in found], float),
        "value": np.array([v for _, v in found]),
    }


def ask_robot(command: str, world: World) -> Answer:
    """``feeler robot classify --json``, and ``stream --json`` for one touch after the other."""
    decoder, classifier, _ = learn_robot()
    known = {
        "draw_training_set": lambda *_, **__: Belief(),
        "make_decoder": lambda *_, **__: decoder,
        "make_classifier": lambda *_, **__: classifier,
    }
    words, found = ["--speeds", "0.27", "--locations", "0.5,0.9", "--json"], {}
    with patch.multiple(feeler.robot, **known), tempfile.TemporaryDirectory() as folder:
        names = [f"{k}.csv" for k in range(len(world.touches))]
        for name, touch in zip(names, world.touches, strict=True):
            lines = write_touch(*touch, world.torn)
            if command == "stream":
                with patch.object(sys, "stdin", io.TextIOWrapper(io.BytesIO(lines))):
                    said = read_json(run("robot", "stream", "-", *words, cwd=folder))
                found |= {f"{name[0]} {k}": v for k, v in said.items()}
            head = ",".join(["time_ms", *(f"hinge{n}_rad" for n in range(1, 9))])
            Path(folder, name).write_bytes(head.encode() + b"\n" + lines)
        if command == "stream":
            return found
        said = read_json(run("robot", "classify", *names, *words, cwd=folder))
        return {k.removeprefix("[").replace("]", " ", 1): v for k, v in said.items()}


class Belief:
    """Touches that were learned before."""

    def watch(self, decoder: Any) -> Any:
        return decoder


def write_touch(time: np.ndarray, values: np.ndarray, torn: bool) -> bytes:
    rows = [",".join(f"{v:.10g}" for v in row) for row in np.vstack([time, values]).T]
    rows = [
        row
        for k, row in enumerate(rows)
        for row in ([row[:17], row] if torn and k % 40 == 9 else [row])
    ]
    return ("\n".join(rows) + "\n").encode()


def experiment(world: World) -> Answer:
    """The quantities that calibration compares, of several antennas at once."""
    names = ("frequency", "damping_ratio", "ratio_71", "ratio_86")
    found = Protocol().measure_many(list(world.antennas), names)
    return {"measured": label([item.values for item in found], "trial", "quantity")}


def converse(world: World) -> Answer:
    """What the studio's page is told of a touch; with a study also what it is told it was."""
    heard: list = []
    session = Session(lambda data: heard.append(unpack(data)))
    messages = [{"type": "touch", "slot": "A", "id": 1, "wish": world.wish}]
    if world.study:
        about = {"antenna": world.wish.get("antenna", {}), "speed": world.wish["speed"]}
        messages.insert(0, {"type": "study", "slot": "A", "id": 0, **about})
    for message in messages:
        session.take(json.dumps(message))
        end = time.monotonic() + 300
        while session.busy and time.monotonic() < end:
            time.sleep(0.002)
    wrong = [header["message"] for header, _ in heard if header["type"] == "error"]
    if wrong:
        pytest.fail(f"the studio refused: {wrong[0]}")
    pieces = [arrays for header, arrays in heard if header.get("part") == "piece"]
    found: Answer = {}
    for name in ("angle", "contact"):
        whole = np.concatenate([arrays[name] for arrays in pieces])
        found[name] = label(whole, "time", *"ab"[: whole.ndim - 1])
    for header, arrays in heard:
        if header["type"] == "reading":
            found["posterior"] = label(arrays["posterior"], "time", "class")
            found["code"] = label(arrays["code"], "component", "time")
            found |= {
                f"said {k}": v for k, v in flatten(header).items() if k not in ("id", "slot")
            }
    return found


def each(kind: str, make: Any, names: Any, words: str = "", **more: Any) -> list[Producer]:
    """A producer for each name of a registry."""
    return [Producer(words + name, kind, partial(make, name), **more) for name in names]


PRODUCERS = [
    Producer("quantities", "scene", lambda w: take_quantities(touch(w))),
    Producer("plot_touch", "scene", lambda w: draw_picture(touch(w))),
    Producer("turnable view", "scene", draw_turnable),
    Producer("touch --json", "scene", ask_touch),
    Producer("simulation", "hand", read_shown),
    *each("touches", measure_index, analysis.INDICES),
    *each("touches", ask_classifier, sorted({*decoding.CLASSIFIERS} - {"cnn"}), "classifier "),
    *each("touches", ask_classifier, ["cnn"], "classifier ", tolerance=1e-6),
    *each("touches", encode_touches, ("sparse", "ridge"), "code "),
    *each("touches", describe_noise, decoding.NOISES, "noise "),
    *each("touches", measure, MEASURES),
    *each("trains", ask_spikes, ("poisson", *spikes.SPIKE_CODES), "spikes "),
    Producer("quantities", "record", lambda w: take_quantities(w.dataset)),
    Producer("groups of an encoder", "record", group),
    Producer("plot_touch", "record", lambda w: draw_picture(w.dataset)),
    Producer("sensilla", "record", excite),
    Producer("spikes --json", "record", lambda w: answer_file("spikes", w, "--gain", "5")),
    Producer("validate --json", "record", partial(answer_file, "validate")),
    *each("bases", compare_bases, BASES),
    Producer("tracks --json", "film", ask_tracks),
    Producer("samples of a board", "lines", listen),
    *each("bent", ask_robot, ("classify", "stream"), "robot "),
    Producer("measured animals", "animals", experiment),
    Producer("studio", "wish", converse),
    Producer("encoder", "calls", learn),
    Producer("wall --json", "named", ask_wall),
    Producer("calibrate --json", "release", ask_release),
]
"""One list: a new quantity, index, classifier, code or noise is in it as soon as it is known."""
