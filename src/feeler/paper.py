"""An older name of :func:`feeler.presets.paper_trials`, until feeler 0.5."""

import warnings
from typing import Any

from feeler.objects.trials import Trial
from feeler.presets import paper_trials


def trials(*args: Any, **kwargs: Any) -> list[Trial]:
    """The touches of the paper."""
    warnings.warn(
        "feeler.paper.trials() is now feeler.presets.paper_trials().",
        DeprecationWarning,
        stacklevel=2,
    )
    return paper_trials(*args, **kwargs)
