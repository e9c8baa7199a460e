"""The studio: an antenna in your browser. A local server, a notebook widget and exported pages
share one front end.
"""

from feeler.studio.alone import write_touch_page
from feeler.studio.board import Boards
from feeler.studio.server import Studio
from feeler.studio.session import Session
from feeler.studio.widget import show_studio
from feeler.studio.wish import AntennaWish, ObjectWish, TouchWish

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
