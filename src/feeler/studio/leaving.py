"""Whatever is shown can leave: as antenna file, Python script, picture, movie or a page that
computes by itself.
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
from feeler.studio.alone import write_touch_page
from feeler.studio.hand import LONGEST, read_commands, replay
from feeler.studio.script import write_script
from feeler.studio.touching import (
    INTERVAL,
    count_samples,
    find_sensed,
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
    second = None if other is None else TouchWish.from_plain(other).antenna
    return write_touch_page(wish, second, unsure=unsure, commands=commands, samples=samples)
