"""Whatever is shown can leave: as antenna file, Python script, picture, movie or a page that plays
by itself.
"""

import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.file import write_antenna
from feeler.errors import InvalidInput
from feeler.experiment.touch import touch
from feeler.plotting.look import style
from feeler.studio import study
from feeler.studio.exporting import write_player
from feeler.studio.hand import LONGEST, read_commands, replay
from feeler.studio.script import write_script
from feeler.studio.touching import (
    INTERVAL,
    count_samples,
    describe_scene,
    find_sensed,
    hash_tensor,
    simulate_pieces,
)
from feeler.studio.wish import TouchWish, read_number


@dataclass(frozen=True, kw_only=True)
class Leaving:
    """A file that leaves the page."""

    name: str
    mime: str
    content: bytes


def make_file(message: dict[str, Any]) -> Leaving:
    """What the page asks to be saved: ``what`` is toml, script, svg, png, mp4 or html."""
    wish = TouchWish.from_plain(message.get("wish"))
    commands = read_commands(message["commands"]) if message.get("commands") else None
    samples = int(read_number(message.get("samples", count_samples(wish)), "samples", 2, LONGEST))
    unsure = read_number(message.get("unsure", study.UNSURE), "unsure", 0.0, 0.5)
    what, quantity = message.get("what"), str(message.get("quantity", "angle"))
    makers: dict[str, tuple[str, Callable[[], bytes]]] = {
        "toml": ("application/toml", lambda: write_antenna(wish.antenna.make()).encode()),
        "script": ("text/x-python", lambda: write_script(wish, commands, samples).encode()),
        **{
            kind: (mime, partial(_draw, wish, commands, samples, kind, quantity))
            for kind, mime in (("svg", "image/svg+xml"), ("png", "image/png"))
        },
        "mp4": ("video/mp4", partial(_film, wish, commands)),
        "html": (
            "text/html",
            lambda: _write_html(wish, message.get("other"), commands, samples, unsure).encode(),
        ),
    }
    if not isinstance(what, str) or what not in makers:
        raise InvalidInput(f"what must be one of {', '.join(makers)}, got {str(what)[:40]!r}.")
    mime, make = makers[what]
    stem = "antenna" if what == "toml" else "touch"
    return Leaving(
        name=f"feeler-{stem}.{'py' if what == 'script' else what}", mime=mime, content=make()
    )


def _read_whole(wish: TouchWish, commands: list | None, samples: int) -> dict[str, np.ndarray]:
    """The readings of a touch, or of a run by hand, from its first to its last sample."""
    if commands is not None:
        return replay(wish, commands, samples)
    pieces = [readings for _, readings in simulate_pieces(wish, Event())]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


def _draw(wish: TouchWish, commands: list | None, samples: int, kind: str, quantity: str) -> bytes:
    """The tensor as the page shows it: angles in degrees, or curvature."""
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    from feeler.plotting import plot_tensor

    antenna = wish.antenna.make()
    index = find_sensed(antenna)
    shown = _read_whole(wish, commands, samples)["angle"][:, index].T
    label = "hinge angle [°]"
    if quantity == "curvature":
        shown = shown / antenna.segment_length[index][:, None]
        label = "curvature [1/mm]"
    else:
        shown = np.rad2deg(shown)
    by_hand = "by hand" if commands is not None else f"{wish.speed:g} m/s"
    with style():
        figure = Figure(figsize=(4.5, 3.2), layout="constrained")
        ax = figure.subplots()
        norm = Normalize(0.0, max(float(shown.max()), 1e-9))
        image = plot_tensor(shown, INTERVAL * np.arange(shown.shape[1]), ax, norm)
        ax.set_title(f"{antenna.name}: {wish.make_trial().label}, {by_hand}", fontsize=8)
        figure.colorbar(image, ax=ax, label=f"{label} (negative drawn as 0)")
        out = io.BytesIO()
        figure.savefig(out, format=kind)
    return out.getvalue()


def _film(wish: TouchWish, commands: list | None) -> bytes:
    from feeler.plotting import write_touch_movie

    if commands is not None or wish.objects:
        raise InvalidInput(
            "a movie shows one object that meets the antenna; take the other objects away, or save"
            " the page."
        )
    antenna, trial = wish.antenna.make(), wish.make_trial()
    tensors = touch(antenna, trial, duration=wish.duration, all_hinges=True)
    with tempfile.TemporaryDirectory(prefix="feeler-studio-") as folder:
        return write_touch_movie(antenna, trial, tensors, Path(folder) / "touch.mp4").read_bytes()


def _write_html(
    wish: TouchWish, other: Any, commands: list | None, samples: int, unsure: float
) -> str:
    slots = {"A": wish} | ({"B": TouchWish.from_plain(other)} if other is not None else {})
    records = []
    for slot, one in slots.items():
        one = one if not one.preview else TouchWish.from_plain(one.to_plain() | {"preview": False})
        given = commands if slot == "A" else None
        readings = _read_whole(one, given, samples)
        records += _record_touch(slot, one, readings, unsure, by_hand=given is not None)
    return write_player(records)


def _record_touch(
    slot: str,
    wish: TouchWish,
    readings: dict[str, np.ndarray],
    unsure: float,
    by_hand: bool = False,
) -> list:
    """Headers and arrays of a recorded touch, in the order in which a page hears them."""
    antenna = wish.antenna.make()
    about = {"slot": slot, "id": 0, "hand": by_hand}
    tensor = readings["angle"][:, find_sensed(antenna)].T
    begin = {
        "part": "begin",
        "total": len(readings["angle"]),
        "wish": wish.to_plain(),
        **describe_scene(wish),
    }
    begin["antenna"] = _shorten(begin["antenna"])
    records: list[tuple[dict[str, Any], dict[str, np.ndarray]]] = [
        ({"type": "touch", **about, **begin}, {}),
        ({"type": "touch", **about, "part": "piece", "first": 0}, readings),
        (
            {
                "type": "touch",
                **about,
                "part": "end",
                "hash": hash_tensor(tensor),
                "preview": False,
            },
            {},
        ),
    ]
    known = study.find_study(antenna, wish.speed, unsure)
    if known is not None and not by_hand and tensor.shape[1] >= known.encoder.n_lags:
        posterior, noticed = known.decode(tensor[:, : known.tensors.shape[2]], Event())
        learned = {
            "type": "study",
            "slot": slot,
            "id": 0,
            "part": "end",
            "labels": known.labels,
            "speed": known.speed,
            "peak": known.peak,
            "averages": {name: known.average(name) for name in study.INDEX_NAMES},
        }
        matrices = {f"similarity {name}": matrix for name, matrix in known.similarity.items()}
        records.append((learned, {"bases": known.encoder.components_, **matrices}))
        reading = {"type": "reading", "slot": slot, "id": 0, "noticed": noticed}
        records.append((reading, {"code": known.encode(tensor), "posterior": posterior[::2]}))
    return records


def _shorten(antenna: dict[str, Any]) -> dict[str, Any]:
    """What is drawn of an antenna, six digits of it."""
    shown = {name: value for name, value in antenna.items() if name not in ("stiffness", "damping")}
    return shown | {
        name: [float(f"{number:.6g}") for number in shown[name]] for name in ("segments", "rest")
    }
