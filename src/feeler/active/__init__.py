"""Active touch: a body that moves its antenna in order to know.

Environments for Gymnasium are in ``feeler.active.environment``, which needs the extra ``active``;
nothing else here does. Policies against each other: ``feeler.active.contests``.
"""

from feeler.active.observer import Episodes, Known, Observer
from feeler.active.policies import POLICIES, make_learned, parse_policy
from feeler.active.show import film_policy
from feeler.active.tasks import ActiveTask, Arena, FollowTask, LocaliseTask, Start, TouchTask

__all__ = [
    "POLICIES",
    "ActiveTask",
    "Arena",
    "Episodes",
    "FollowTask",
    "Known",
    "LocaliseTask",
    "Observer",
    "Start",
    "TouchTask",
    "film_policy",
    "make_learned",
    "parse_policy",
]
