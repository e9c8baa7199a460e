"""The data contract: tactile tensors (trial, sensor, time) with units, labels and their whole configuration."""

from feeler.tensors.dataset import make_tensors
from feeler.tensors.rectify import rectify, scale_common
from feeler.tensors.validate import find_breaches, validate

__all__ = ["find_breaches", "make_tensors", "rectify", "scale_common", "validate"]
