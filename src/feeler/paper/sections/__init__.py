"""One module per section of the report: compute with the rooms, draw with the figure modules, keep the numbers."""

from feeler.paper.sections import antenna, calibration, cnn, encoding, reading, robot, tensors, tracking, wall

__all__ = ["antenna", "calibration", "cnn", "encoding", "reading", "robot", "tensors", "tracking", "wall"]
