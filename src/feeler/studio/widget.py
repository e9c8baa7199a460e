"""The studio in a notebook's cell: the same front end; the kernel replaces the server."""

import json
from typing import Any

from feeler.antenna.antenna import Antenna
from feeler.errors import require_extra
from feeler.records.checked import checked
from feeler.studio.exporting import read_page, write_module
from feeler.studio.session import Session
from feeler.studio.wish import AntennaWish, wish_for


@checked
def show_studio(antenna: Antenna | str = "exponential") -> Any:
    """A widget for Jupyter, VS Code, Colab or marimo; show it as a cell's last value.

    Parameters
    ----------
    antenna
        The name of a preset, or an antenna of your own.

    Returns
    -------
    anywidget.AnyWidget
        Its ``session`` does the work; ``close()`` ends it.

    Raises
    ------
    MissingExtra
        anywidget is not installed.
    InvalidInput
        No preset of this name.
    """
    return _make_widget(wish_for(antenna))


def _make_widget(wish: AntennaWish) -> Any:
    """The widget of a wish."""
    require_extra("anywidget", "notebook", "the studio in a notebook")
    import anywidget

    class StudioWidget(anywidget.AnyWidget):
        _esm = write_module()
        _css = read_page("studio.css")

        def __init__(self) -> None:
            super().__init__()
            self.session = Session(lambda data: self.send({}, buffers=[data]), wish)
            self.on_msg(lambda widget, content, buffers: self.session.take(json.dumps(content)))

        def close(self) -> None:
            self.session.close()
            super().close()

    return StudioWidget()
