"""Numbers of the page "What slow, graded antennae buy", made at paper scale (half an hour on two
quiet cores).

python benchmarks/beyond.py    writes benchmarks/results/beyond.json, which the documentation's
build reads.
"""

import json
from pathlib import Path

import feeler
from feeler.report.section import to_json
from feeler.studies.paper import open_bounds, open_gradient, open_speed
from feeler.studies.paper.context import Context
from feeler.studies.tradeoff import load_declared

RESULTS = Path(__file__).parent / "results" / "beyond.json"


def collect(measured, gradient, bounds) -> dict:
    """Every value, and how many sets of touches stand behind it."""
    declared, asked = load_declared(), open_gradient.load_questions("regression", {})
    first = next(iter(measured.values()))
    values = open_speed.collect_values(measured, declared)
    values |= open_gradient.collect_values(gradient) | open_bounds.collect_values(bounds, asked)
    values |= {f"choices.{kind}": level for kind, level in declared.headline.items()}
    values |= {"tradeoff.sets": first.sizes["set"], "gradient.sets": gradient.sizes["set"]}
    return to_json(values)


def main() -> None:
    context, antenna = Context(scale="paper"), feeler.presets.cockroach()
    measured = open_speed.compute(context, load_declared())
    gradient = open_gradient.compute(
        antenna, open_gradient.load_questions("gradient", {}), load_declared()
    )
    bounds = open_bounds.compute(antenna, open_gradient.load_questions("regression", {}))
    RESULTS.write_text(
        json.dumps(collect(measured, gradient, bounds), indent=1, sort_keys=True) + "\n"
    )


if __name__ == "__main__":
    main()
