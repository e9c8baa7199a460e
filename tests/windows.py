"""Which comparisons of profiles stand in the paper's window of 380 ms alone."""

import re

COMPARED = ("exponential", "linear", "uniform", "matched", "rival")
WINDOWLESS = (
    *(
        "wall",
        "robot",
        "window",
        "tradeoff",
        "gradient",
        "choices",
        "design",
        "active",
        "bounds",
    ),
    *("axes", "antenna", "calibration", "tensors", "tracking"),
)
"""Kinds of values, by how their keys begin, that hang on no window of slow touches."""
UNCUT = ("complete touches", "complete", "within each touch", "while it moves")
CUT = ("380 ms window", "cut")


def find_one_sided(keys):
    """Measures in which values of these keys compare profiles in the paper's window alone.

    Some of the linear and of the uniform profile's touches are the same tensor in that window, so
    no page, figure, claim or sentence compares profiles there without complete touches beside it.
    A key that names no window is of the paper's.
    """
    found = {}
    for key in keys:
        parts = re.split(r"[.,]\s*", key)
        profile = next((part for part in parts if part in COMPARED), "")
        if profile and parts[0] not in WINDOWLESS:
            uncut = any(part in UNCUT for part in parts)
            rest = [part for part in parts if part not in (*UNCUT, *CUT, profile)]
            sides = found.setdefault(".".join(rest), {True: set(), False: set()})
            sides[uncut].add(profile)
    return {
        measure
        for measure, sides in found.items()
        if len(sides[False]) > 1 and not sides[False] <= sides[True]
    }
