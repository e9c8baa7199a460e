"""What was found with the library.

``paper`` holds every figure and claim of the paper and the questions beyond it (start with
``paper/reproduce.py``), ``tradeoff`` how fast to touch, ``contests`` how to move in order to know,
``comparison`` any antennas side by side. A ``study`` says what is asked and how much of it is
computed; ``scale`` says how much smoke, quick and paper compute of everything. Nothing of the
library imports from here.
"""
