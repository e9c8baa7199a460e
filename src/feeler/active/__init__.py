"""Active touch: a body that moves its antenna in order to know.

Where Gymnasium is installed (the extra ``active``), importing this registers its environments, of
``feeler.active.environment``. Policies against each other: ``feeler.active.contests``.
"""

from importlib.util import find_spec

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

if find_spec("gymnasium"):
    from feeler.active import environment  # noqa: F401
