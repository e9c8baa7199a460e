"""Active touch: a body that moves its antenna in order to know.

Environments for Gymnasium are in ``feeler.active.environment``, which needs the extra ``active``;
nothing else here does.
"""

from feeler.active.arena import Arena, Reading
from feeler.active.compare import (
    compare_policies,
    confirm_steering,
    judge_energy,
    judge_learned,
    judge_steering,
)
from feeler.active.deciding import decide, measure_calibration
from feeler.active.declared import Contest, load_contest
from feeler.active.follow import FollowTask
from feeler.active.learned import make_learned
from feeler.active.noticing import Noticer, make_noticer
from feeler.active.observer import Episodes, Known, Observer, compute_posterior
from feeler.active.page import film_policy, write_active
from feeler.active.places import Places, Search, search_places, simulate_places
from feeler.active.policies import POLICIES, parse_policy
from feeler.active.recorded import Recorded, record_episodes
from feeler.active.recurrent import RecurrentDecoder
from feeler.active.task import ActiveTask, LocaliseTask, Start, TouchTask
from feeler.active.travel import TravelDecoder

__all__ = [
    "POLICIES",
    "ActiveTask",
    "Arena",
    "Contest",
    "Episodes",
    "FollowTask",
    "Known",
    "LocaliseTask",
    "Noticer",
    "Observer",
    "Places",
    "Reading",
    "Recorded",
    "RecurrentDecoder",
    "Search",
    "Start",
    "TouchTask",
    "TravelDecoder",
    "compare_policies",
    "compute_posterior",
    "confirm_steering",
    "decide",
    "film_policy",
    "judge_energy",
    "judge_learned",
    "judge_steering",
    "load_contest",
    "make_learned",
    "make_noticer",
    "measure_calibration",
    "parse_policy",
    "record_episodes",
    "search_places",
    "simulate_places",
    "write_active",
]
