"""The paper, figure by figure."""

from feeler.paper.trials import trials

__all__ = ["trials"]
