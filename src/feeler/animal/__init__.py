"""An animal from its measurements: a fitted antenna, and what it predicts."""

from feeler.animal.page import save_fit, write_animal_page
from feeler.animal.plan import PLANTED, AnimalPlan, load_animal, write_example, write_template
from feeler.animal.study import AnimalStudy, study_animal

__all__ = [
    "PLANTED",
    "AnimalPlan",
    "AnimalStudy",
    "load_animal",
    "save_fit",
    "study_animal",
    "write_animal_page",
    "write_example",
    "write_template",
]


__dir__ = __all__.copy
