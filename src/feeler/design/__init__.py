"""Which antenna should I build? A task, a score on held-out touches, a space of antennas,
constraints, and a search.
"""

from feeler.design.page import write_design
from feeler.design.plan import (
    DesignOutcome,
    DesignPlan,
    load_plan,
    make_strips,
    measure_tolerance,
    run_plan,
)
from feeler.design.scoring import (
    CHOICES,
    DesignTask,
    Score,
    choose_sensors,
    measure_sensors,
    score,
)
from feeler.design.search import (
    SEARCHES,
    Candidate,
    Constraints,
    Design,
    DesignProblem,
    Optimum,
    Space,
    match_compliance,
    optimise,
)

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
    "choose_sensors",
    "load_plan",
    "make_strips",
    "match_compliance",
    "measure_sensors",
    "measure_tolerance",
    "optimise",
    "run_plan",
    "score",
    "write_design",
]


__dir__ = __all__.copy
