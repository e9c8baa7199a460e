"""Speed against accuracy against energy: what a touch tells by when, and what it costs, for any
antenna.
"""

from feeler.studies.study import Study
from feeler.studies.tradeoff.best import average_sets, find_best
from feeler.studies.tradeoff.declared import load_declared
from feeler.studies.tradeoff.page import split_measured, write_tradeoff

__all__ = [
    "Study",
    "average_sets",
    "find_best",
    "load_declared",
    "split_measured",
    "write_tradeoff",
]
