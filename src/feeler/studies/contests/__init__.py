"""Contests: does it pay to steer? Policies against each other under one ideal observer, as declared
beforehand in declared.toml.
"""

from feeler.studies.contests.contest import Contest, load_contest
from feeler.studies.contests.judge import (
    confirm_steering,
    judge_energy,
    judge_learned,
    judge_steering,
)
from feeler.studies.contests.measured import load_stored
from feeler.studies.contests.page import write_active

__all__ = [
    "Contest",
    "confirm_steering",
    "judge_energy",
    "judge_learned",
    "judge_steering",
    "load_contest",
    "load_stored",
    "write_active",
]
