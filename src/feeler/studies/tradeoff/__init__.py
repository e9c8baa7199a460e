"""Speed against accuracy against energy: what a touch tells by when, and what it costs, for any
antenna.
"""

from feeler.studies.tradeoff.best import average_sets, find_best
from feeler.studies.tradeoff.declared import Declared, load_declared
from feeler.studies.tradeoff.measure import draw_touches, measure_tradeoff
from feeler.studies.tradeoff.page import write_tradeoff

__all__ = [
    "Declared",
    "average_sets",
    "draw_touches",
    "find_best",
    "load_declared",
    "measure_tradeoff",
    "write_tradeoff",
]
