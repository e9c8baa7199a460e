"""One module per section of the report: compute with the rooms, draw with the figure modules, keep the numbers."""

from feeler.paper.sections import antenna, cnn, encoding, reading, robot, tensors, tracking

__all__ = ["antenna", "cnn", "encoding", "reading", "robot", "tensors", "tracking"]
