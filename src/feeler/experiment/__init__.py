"""What one does with an antenna: touch, bend, release. Each runs the physics and gives a Dataset."""

from feeler.experiment.bend import bend
from feeler.experiment.release import release
from feeler.experiment.touch import touch

__all__ = ["bend", "release", "touch"]
