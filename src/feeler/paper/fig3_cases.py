"""Beside Fig. 3B: what R² depends on, under choices that the paper does not state."""

from feeler.paper.context import Context
from feeler.paper.fig3 import load
from feeler.report.section import Section
from feeler.wall.sensitivity import CHOICES, Case, count_orderings


def tabulate(cases: list[Case]) -> list[dict[str, object]]:
    """The sensitivity table as rows of plain values; R² is None where it is undefined."""
    return [
        {
            "antenna": case.antenna,
            "reading": case.posture.reading,
            "friction": case.posture.friction,
            "prebend": case.posture.prebend,
            "hook_share": case.posture.hook_share,
            "tip_heading": case.posture.tip_heading,
            **case.measure,
            "in_contact": case.n_contact,
            "inverted": case.n_inverted,
            "used": int(case.map.used.sum()),
            "at_base": int(case.map.at_base.sum()),
            "r2": None if case.map.undefined else round(case.map.r2, 4),
            "undefined": case.map.undefined,
            "slope": None if case.map.undefined else round(case.map.slope, 4),
            "error_mm": None if case.map.undefined else round(case.map.error, 3),
            "monotone": case.map.monotone,
        }
        for case in cases
    ]


def show(context: Context, section: Section) -> None:
    """Every set-up, and how often the paper's order holds."""
    data = load(context)
    if not data.cases:
        return
    section.heading("What R² depends on")
    counts = count_orderings(data.cases)
    section.text(_count_orders(counts))
    section.text(
        "Below paper scale each set-up changes one choice of the default. The hook over the whole length is among them because "
        "the paper's order had been seen to hold there; the full table of paper scale has every combination."
    )
    section.table(
        ["choice", "value", "order holds", "does not", "cannot be judged"],
        [[*key, n["yes"], n["no"], n["undefined"]] for key, n in counts.items() if key[0] != "all"],
        "Set-ups by the value of each choice that the paper does not state.",
    )
    names = list(dict.fromkeys(case.antenna for case in data.cases))
    found: dict[tuple, dict[str, float]] = {}
    for case in data.cases:
        found.setdefault(case.choice, {})[case.antenna] = case.map.r2
    section.table(
        [*CHOICES, *(f"R² {name}" for name in names)],
        [[*choice, *(r2[name] for name in names)] for choice, r2 in found.items()],
        "R² of every set-up. Undefined: the peak stays at one place, mostly the base hinge, or too few distances hold a J.",
    )
    section.numbers("fig3_sensitivity", rows=tabulate(data.cases))


def _count_orders(counts: dict[tuple, dict[str, int]]) -> str:
    """In how many set-ups the paper's order of R² holds."""
    every = counts["all", ""]
    judged = every["yes"] + every["no"]
    return (
        f"The paper's order is R² falling from exponential over linear to constant. Of {judged + every['undefined']} set-ups, "
        f"R² is defined for all three in {judged}; the order holds in {every['yes']} of these. Each choice and how often:"
    )
