"""The page's own functions, run by node without a page, against what Python makes of the same."""

import base64
import json
import shutil
import subprocess
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from feeler.presets import make_preset
from feeler.spikes import CAMPANIFORM, place_sensilla
from feeler.spikes.sensilla import TABLE, encode_touch
from feeler.studio.export import (
    _bundle,
    _pack,
    _pack_contact,
    _pack_shapes,
    read_page,
)
from feeler.studio.live import replay
from feeler.studio.requests import (
    AntennaRequest,
    TouchRequest,
    describe_original,
    simulate_pieces,
)
from feeler.studio.server import FILES
from feeler.studio.session import pack
from feeler.studio.study import KINDS, Range, TouchDecoder

TESTS = ("page.test.mjs", "drawn.test.mjs", "app.test.mjs")
WISHES = (
    {"preset": "linear"},
    {"preset": "exponential", "stiffness": [[0, 20], [0.37, 3], [1, 0.01]]},
    {"preset": "linear", "stiffness": [[0, 9], [0.2, 5], [1, 0.02]], "matched": True},
    {"preset": "robot", "damping": [[0, 8], [1, 0.4]]},
)


def make_given():
    """Inputs, and what Python says of them."""
    rng = np.random.default_rng(3)
    arrays = {
        "angle": rng.normal(size=(7, 3)).astype("<f4"),
        "contact": rng.normal(size=7).astype("<f4"),
    }
    packed = {
        name: {"shape": list(a.shape), "values": a.ravel().astype(float).tolist()}
        for name, a in arrays.items()
    }
    curves = []
    for wish in WISHES:
        made = AntennaRequest.from_plain(wish).make()
        curves.append(
            {
                "wish": wish,
                "original": describe_original(make_preset(wish["preset"])),
                "stiffness": made.stiffness.tolist(),
                "damping": made.damping.tolist(),
            }
        )
    content = base64.b64encode(pack({"part": "piece"}, **arrays)).decode()
    return {
        "packed": {"content": content, "arrays": packed},
        "curves": curves,
        "decoder": make_taught(rng),
        "nerve": make_nerve(rng),
        "host": make_host(),
    }


SEVERAL = (
    {"kind": "box", "size": 1.3, "x": -6.0, "y": 21.0, "heading": 70.0, "speed": 0.4},
    {"kind": "ball", "size": 0.8, "x": 5.0, "y": 9.0, "heading": -100.0, "friction": 0.3},
)
TOUCHES = (
    {"kind": "ball", "size": 2.4, "location": 0.83, "objects": SEVERAL},
    {"kind": "triangle", "size": 1.7, "location": 0.57, "side": "right", "approach": 71.0},
)
COMMANDS = [(3, -1, 0.05, 0.02, 0.004), (1, 0, 0.0, 0.0, 0.0), (9, 0, -0.2, 0.1, 0.0)]


def make_host():
    """What a standalone page holds, and what feeler makes of its touches."""
    antennas = ({"preset": "robot"}, {"preset": "linear", "length": 30.0, "sensors": 7})
    wishes = [
        TouchRequest.from_plain(
            {"antenna": antenna, "speed": 0.3, "lead": 3.0, "duration": 70.0, "friction": 0.6}
            | touch
        )
        for antenna, touch in zip(antennas, TOUCHES, strict=True)
    ]
    config = {
        "version": "1",
        "state": {"A": wishes[0].antenna.to_plain(), "touch": {}},
        "contact": _pack_contact(),
        "antennas": [
            _pack(name, wish.antenna)
            for name, wish in zip(("first", "second"), wishes, strict=True)
        ],
        "speeds": [{"name": "slow", "value": 0.06}],
        "shapes": _pack_shapes(wishes[0].antenna.make()),
        "commands": None,
        "samples": 0,
    }
    touches = []
    slippery = [wishes[0].replace(friction=mu, objects=()) for mu in (0.0, 0.4, 2.5)]
    for wish in (*wishes, wishes[1].replace(preview=True), *slippery):
        pieces = [piece for _, piece in simulate_pieces(wish, Event())]
        shown = {
            name: np.concatenate([piece[name] for piece in pieces]).tolist()
            for name in ("angle", "place", "force")
        }
        touches.append({"wish": wish.to_plain(), **shown})
    moved = replay(wishes[0], COMMANDS, 60)
    run = {name: moved[name].tolist() for name in ("angle", "base", "place")}
    return {
        "config": config,
        "touches": touches,
        "run": {"commands": COMMANDS, "samples": 60, **run},
    }


def make_nerve(rng):
    """Bending that comes and goes in both directions, and the rates of sensilla that feel it."""
    time = np.arange(120) * 0.7
    bent = np.sin(time[:, None] / (9, 14, 23) + (0, 1, 2)) * rng.uniform(0.02, 0.05, size=3)
    bent[:20] = 0.0
    bent[20:26] *= np.linspace(0, 1, 6)[:, None]
    population = place_sensilla(np.array([0.1, 0.4, 0.9]), 30.0)
    rates = np.empty((120, 6))
    fixed = (
        *population.find_taps(np.array([0.1, 0.4, 0.9])),
        population.side * population.gain,
    )
    encode_touch(bent, *fixed, population.table, 0.7, rates)
    known = {name: getattr(CAMPANIFORM, name) for name in TABLE if name != "v"}
    return {"bent": bent.tolist(), "rates": rates.tolist(), "sensillum": known}


def make_taught(rng):
    """What a decoder learned of simulated bumps, and what it says of others of them: one between
    two kinds, its mirror image, one like none, and nothing.
    """
    samples, sensors = np.arange(60), np.arange(7)[:, None]

    def make(c, at):
        bump = ((samples - 25 - 3 * c) / 9) ** 2 + ((sensors - 2 - c - at) / 1.6) ** 2
        return 0.2 * np.exp(-bump)

    touches = np.array([make(k % 3, rng.uniform(0, 1)) for k in range(60)])
    kinds = [KINDS[k % 3] for k in range(60)]
    decoder = TouchDecoder(onset=0.004).fit(touches[:30], kinds[:30])
    decoder.coarsen(0.002).calibrate(touches[30:], kinds[30:])
    packed = decoder.to_plain()["templates"]
    between = 0.6 * touches[31] + 0.4 * touches[32]
    decoder.limit_ *= 3.0  # so that what lies between is known
    felt = [touches[40], between, -between, make(1, -6.0), 0.001 * touches[3]]
    trained = Range.around(0.3, 0.02)
    wishes = [
        TouchRequest.from_plain({"speed": 0.3, "location": 0.7} | more)
        for more in ({}, {"side": "right"}, {"friction": 0.4, "speed": 0.31}, {"location": 0.44},
                     {"size": 3.6, "approach": 71.5}, {"kind": "wall"}, {"objects": SEVERAL})
    ]  # fmt: skip
    return {
        "taught": {
            "templates": packed,
            "kinds": decoder.kinds_.tolist(),
            "onset": decoder.onset,
            "noise": decoder.noise,
            "tempering": decoder.tempering_,
            "limit": decoder.limit_.tolist(),
            "range": trained.to_plain(),
            "scores": {},
        },
        "felt": [one.T.ravel().tolist() for one in felt],
        "noticed": [decoder.decode(one)[1] for one in felt],
        "posterior": [decoder.decode(one)[0].ravel().tolist() for one in felt],
        "wishes": [[wish.to_plain(), trained.find_outside(wish)] for wish in wishes],
    }


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """The page's modules beside what Python says, for node."""
    if shutil.which("node") is None:
        pytest.skip("no node: apt-get install nodejs")
    folder = tmp_path_factory.mktemp("page")
    for name, _ in FILES.values():
        if name.endswith(".js"):
            (folder / name).write_text(read_page(name), encoding="utf-8")
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "given.json").write_text(json.dumps(make_given()))
    for name in TESTS:
        shutil.copy(Path(__file__).with_name(name), folder)
    return folder


def run_node(folder, *words):
    done = subprocess.run(
        ["node", *words], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr + done.stdout[-6000:]
    return done.stdout


@pytest.mark.parametrize("entry", ["studio.js", "alone.js", "worker.js"])
def test_the_modules_are_sound_as_one(copied, entry):
    (copied / f"whole-{entry}").write_text(_bundle(entry), encoding="utf-8")
    run_node(copied, "--check", f"whole-{entry}")


@pytest.mark.further
@pytest.mark.parametrize("name", TESTS)
def test_the_page_s_functions_do_what_python_does_and_draw_what_they_are_given(copied, name):
    assert "# fail 0" in run_node(copied, "--test", name)
