"""Which antenna should I build? A task, a score on touches never met, a space of antennas,
constraints, and a search.
"""

from feeler.design.constraints import Constraints
from feeler.design.making import make_strips, measure_tolerance
from feeler.design.outcome import DesignOutcome, carry_out
from feeler.design.page import write_design
from feeler.design.plan import DesignPlan, load_plan
from feeler.design.problem import Candidate, DesignProblem
from feeler.design.scoring import Score, score
from feeler.design.search import SEARCHES, Optimum, optimise
from feeler.design.sensors import CHOICES, choose_sensors, measure_sensors
from feeler.design.space import Design, Space, match_compliance
from feeler.design.task import DesignTask

__all__ = [
    "CHOICES",
    "SEARCHES",
    "Candidate",
    "Constraints",
    "Design",
    "DesignOutcome",
    "DesignPlan",
    "DesignProblem",
    "DesignTask",
    "Optimum",
    "Score",
    "Space",
    "carry_out",
    "choose_sensors",
    "load_plan",
    "make_strips",
    "match_compliance",
    "measure_sensors",
    "measure_tolerance",
    "optimise",
    "score",
    "write_design",
]
