"""Active touch: a body that moves its antenna in order to know.

Where Gymnasium is installed (the extra ``active``), importing this registers its environments, of
``feeler.active.environment``. Policies against each other: ``feeler.active.contests``.
"""

from importlib.util import find_spec

from feeler.active.observer import Belief, Episodes, Observer
from feeler.active.policies import POLICIES, film_policy, parse_policy
from feeler.active.tasks import ActiveTask, Arena, FollowTask, LocaliseTask, Start, TouchTask
from feeler.renamed import find_renamed

__all__ = [
    "POLICIES",
    "ActiveTask",
    "Arena",
    "Belief",
    "Episodes",
    "FollowTask",
    "LocaliseTask",
    "Observer",
    "Start",
    "TouchTask",
    "film_policy",
    "parse_policy",
]

__getattr__ = find_renamed(__name__)

if find_spec("gymnasium"):
    from feeler.active import environment  # noqa: F401


__dir__ = __all__.copy
