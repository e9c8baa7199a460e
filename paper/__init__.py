"""The paper, figure by figure."""

from feeler.objects.trials import trials

__all__ = ["trials"]
