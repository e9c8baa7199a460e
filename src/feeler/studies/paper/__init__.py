"""The paper, figure by figure."""

from feeler.stimulus.ninety import trials

__all__ = ["trials"]
