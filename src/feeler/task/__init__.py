"""What may be met: objects at places, drawn within nuisances, in which noise and by when."""

from feeler.task.noise import NOISES, Common, Mixed, Noise, Relative, parse_noise
from feeler.task.nuisances import Nuisances
from feeler.task.task import Task

__all__ = ["NOISES", "Common", "Mixed", "Noise", "Nuisances", "Relative", "Task", "parse_noise"]
