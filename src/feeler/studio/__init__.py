"""The studio: an antenna in your browser. A local server, a notebook widget and exported pages
share one front end.
"""

from feeler.studio.export import write_touch_page
from feeler.studio.live import Boards
from feeler.studio.requests import AntennaWish, ObjectWish, TouchWish
from feeler.studio.server import Studio, show_studio
from feeler.studio.session import Session

__all__ = [
    "AntennaWish",
    "Boards",
    "ObjectWish",
    "Session",
    "Studio",
    "TouchWish",
    "show_studio",
    "write_touch_page",
]
