"""Whatever is shown can leave: as antenna file, Python script, picture, movie or a page that
computes by itself.
"""

from collections.abc import Callable
from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.file import write_antenna
from feeler.errors import InvalidInput
from feeler.studio import study
from feeler.studio.alone import write_touch_page
from feeler.studio.drawing import PageView, draw, film, read_shown
from feeler.studio.hand import LONGEST, read_commands, replay
from feeler.studio.script import write_script
from feeler.studio.touching import count_samples, simulate_pieces
from feeler.studio.wish import TouchWish, read_number


def make_file(message: dict[str, Any]) -> tuple[str, str, bytes]:
    """Name, kind and content of what the page asks to be saved: ``what`` is toml, script, svg, png,
    mp4 or html.
    """
    wish = TouchWish.from_plain(message.get("wish"))
    commands = read_commands(message["commands"]) if message.get("commands") else None
    samples = int(
        read_number(message.get("samples", count_samples(wish)), "samples", 2, LONGEST)
    )
    unsure = read_number(message.get("unsure", study.UNSURE), "unsure", 0.0, 0.5)
    what, quantity = message.get("what"), str(message.get("quantity", "angle"))

    def shown() -> PageView:
        readings = _read_whole(wish, commands, samples)
        return read_shown(wish, readings, quantity, by_hand=commands is not None)

    makers: dict[str, tuple[str, Callable[[], bytes]]] = {
        "toml": ("application/toml", lambda: write_antenna(wish.antenna.make_any()).encode()),
        "script": ("text/x-python", lambda: write_script(wish, commands, samples).encode()),
        "svg": ("image/svg+xml", lambda: draw(shown(), "svg")),
        "png": ("image/png", lambda: draw(shown(), "png")),
        "mp4": ("video/mp4", lambda: film(shown())),
        "html": (
            "text/html",
            lambda: _write_html(wish, message.get("other"), commands, samples, unsure).encode(),
        ),
    }
    if not isinstance(what, str) or what not in makers:
        raise InvalidInput(f"what must be one of {', '.join(makers)}, got {str(what)[:40]!r}.")
    mime, make = makers[what]
    stem = "antenna" if what == "toml" else "touch"
    return f"feeler-{stem}.{'py' if what == 'script' else what}", mime, make()


def _read_whole(wish: TouchWish, commands: list | None, samples: int) -> dict[str, np.ndarray]:
    """The readings of a touch, or of a run by hand, from its first to its last sample."""
    if commands is not None:
        return replay(wish, commands, samples)
    pieces = [readings for _, readings in simulate_pieces(wish, Event())]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}


def _write_html(
    wish: TouchWish, other: Any, commands: list | None, samples: int, unsure: float
) -> str:
    second = None if other is None else TouchWish.from_plain(other).antenna
    return write_touch_page(wish, second, unsure=unsure, commands=commands, samples=samples)
