"""The studio: an antenna in your browser. A local server, a notebook widget and exported pages
share one front end.
"""

from feeler.renamed import find_renamed
from feeler.studio.export import write_touch_page
from feeler.studio.live import Boards
from feeler.studio.requests import AntennaRequest, ObjectRequest, TouchRequest
from feeler.studio.server import Studio, show_studio
from feeler.studio.session import Session

__all__ = [
    "AntennaRequest",
    "Boards",
    "ObjectRequest",
    "Session",
    "Studio",
    "TouchRequest",
    "show_studio",
    "write_touch_page",
]

__getattr__ = find_renamed(__name__)

__dir__ = __all__.copy
