"""Any antennas side by side on the same touches, as numbers and as a page."""

from feeler.studies.comparison.compare import Comparison, compare_antennas, touch_whole
from feeler.studies.comparison.page import write_comparison

__all__ = ["Comparison", "compare_antennas", "touch_whole", "write_comparison"]
