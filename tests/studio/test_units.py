"""The page's own functions, run by node without a page, against what Python makes of the same."""

import base64
import json
import shutil
import subprocess
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from feeler.decoding import StreamDecoder
from feeler.presets import make_preset
from feeler.spikes import CAMPANIFORM, place_sensilla
from feeler.spikes.kernel import TABLE, encode_touch
from feeler.studio.alone import _pack, _pack_contact, _pack_expected, _pack_shapes
from feeler.studio.catalogue import describe_original
from feeler.studio.exporting import bundle, read_page
from feeler.studio.hand import replay
from feeler.studio.messages import pack
from feeler.studio.server import FILES
from feeler.studio.study import _ONSET, LOUDNESS
from feeler.studio.touching import simulate_pieces
from feeler.studio.wish import AntennaWish, TouchWish

TESTS = {"page.test.mjs": 15, "drawn.test.mjs": 19, "app.test.mjs": 32}  # laws in each
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
        made = AntennaWish.from_plain(wish).make()
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
    """What a page that computes by itself holds, and what feeler makes of its touches."""
    antennas = ({"preset": "robot"}, {"preset": "linear", "length": 30.0, "sensors": 7})
    wishes = [
        TouchWish.from_plain(
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
    for wish in (*wishes, wishes[1].replace(preview=True)):
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
    """What a decoder learned of three planted classes, and what it says of a fourth touch between
    two of them.
    """
    samples, sensors = np.arange(60), np.arange(7)[:, None]
    touches = [
        LOUDNESS * np.exp(-(((samples - 25 - 3 * c) / 9) ** 2) - ((sensors - 2 - c) / 1.6) ** 2)
        for c in range(3)
    ]
    decoder = StreamDecoder(
        window=60, onset=LOUDNESS * _ONSET, max_lag=4, lag_step=2, noise=0.0, correlation=220.0
    ).fit(touches, [0, 1, 2])
    felt = 0.8 * touches[1] + 0.2 * touches[0] + rng.normal(scale=2e-4, size=touches[0].shape)
    states = decoder.replay(felt)
    return {
        "kept": _pack_expected(decoder.expected_, 0.002),
        "expected": np.moveaxis(decoder.expected_, 1, 2).reshape(3, -1).tolist(),
        "felt": felt.T.ravel().tolist(),
        "noticed": next(k for k, state in enumerate(states) if state.since_contact >= 0),
        "posterior": np.ravel([state.posterior for state in states]).tolist(),
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
    (copied / f"whole-{entry}").write_text(bundle(entry), encoding="utf-8")
    run_node(copied, "--check", f"whole-{entry}")


@pytest.mark.further
@pytest.mark.parametrize("name", TESTS)
def test_the_page_s_functions_do_what_python_does_and_draw_what_they_are_given(copied, name):
    assert f"# pass {TESTS[name]}" in run_node(copied, "--test", name)
