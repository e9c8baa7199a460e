"""An animal from its measurements: a fitted antenna, and what it predicts."""

from feeler.animal.page import save_fit

__all__ = ["save_fit"]
