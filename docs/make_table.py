"""README's table (figure → command → seconds → headline), made from
benchmarks/results/reproduce.json.

python docs/make_table.py    writes it; tests/laws/test_readme.py fails where README says anything
else.
"""

import json
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "reproduce.json"
HEADLINES = {
    "The antenna": ("Fig. 2A, C", "antenna", "antenna.n_segments", "{:.0f} segments"),
    "Calibration: does the model move like the animal?": (
        "Fig. 2B, S1, Movie S1",
        "calibration",
        "calibration.frequency",
        "{:.1f} Hz damped tip frequency",
    ),
    "Tactile tensors": (
        "Fig. 2D–E, S3, Movie S2",
        "tensors",
        "tensors.count",
        "{:.0f} tensors of one antenna",
    ),
    "Wall distance": (
        "Fig. 3, Movie S3",
        "wall",
        "wall.family.order",
        "curvature follows wall distance best in the exponential antenna in {:.0%} of the set-ups with a map",
    ),
    "Encoding": (
        "Fig. 4, 5F–G, S5",
        "encoding",
        "encoding.location_p",
        "bases map to location: p = {:.3f}",
    ),
    "Dispersion and classification": (
        "Fig. 5A–E, S6",
        "reading",
        "dispersion.tensor.nmi.slow",
        "closest-match NMI {:.2f} at slow touch",
    ),
    "Convolutional network": ("Fig. S4", "cnn", "cnn.slow", "{:.2f} accuracy at slow touch"),
    "Beyond the paper: speed against accuracy against energy": (
        "beyond",
        "tradeoff",
        "tradeoff.whole.common.slowest",
        "a whole slow touch tells {:.1f} of 4.9 bits: which of thirty touches it was",
    ),
    "Beyond the paper: what the gradient does": (
        "beyond",
        "gradient",
        "gradient.common.-0.0827",
        "{:.1f} bits with the published gradient",
    ),
    "Beyond the paper: place, size and speed beside their bounds": (
        "beyond",
        "bounds",
        "bounds.error.location.common.0.003",
        "place to {:.2f} mm",
    ),
    "Beyond the paper: which antenna tells most": (
        "beyond",
        "design",
        "design.fewer.0.3",
        "{:.0%} fewer errors by searched profiles at medium speed",
    ),
    "The robotic antenna": (
        "Fig. 6, S7, Movie S4",
        "robot",
        "robot.transfer",
        "{:.2f} of surrogate contacts read right",
    ),
    "Active touch speed": ("Fig. S2", "tracking", "tracking.mean", "{:.1f} °/s, synthetic tracks"),
}
SCALES = ("smoke", "quick", "paper")
MARKS = re.compile(r"(<!-- figures: .*? -->\n).*(<!-- end of figures -->)", re.S)


def make_table(results: dict) -> str:
    """The table's lines: quick scale, and paper scale for what only that computes whole."""
    lines = ["| figure | command | seconds | headline |", "|---|---|---|---|"]
    for title, (figures, section, key, form) in HEADLINES.items():
        scale = "paper" if section in ("cnn", "wall") else "quick"
        found = results.get(scale, {"stages": {}, "values": {}})
        value = found["values"].get(section, {}).get(key)
        value = value.get("value") if isinstance(value, dict) else value
        command = "`make reproduce SCALE=paper`" if scale == "paper" else "`make reproduce`"
        seconds = found["stages"].get(title)
        headline = form.format(value) if value is not None else "–"
        lines.append(
            f"| {figures} | {command} | {'–' if seconds is None else f'{seconds:.0f}'} |"
            f" {headline} |"
        )
    return (
        "\n".join(
            lines + [_make_total(scale, results[scale]) for scale in SCALES if scale in results]
        )
        + "\n"
    )


def _make_total(scale: str, found: dict) -> str:
    command = "`make reproduce`" if scale == "quick" else f"`make reproduce SCALE={scale}`"
    claims = found["claims"]["paper"]
    evidence = [claims[verdict] for verdict in ("reproduced", "partly", "not reproduced")]
    headline = f"of {sum(claims.values())} statements " + "{} reproduced, {} partly, {} not".format(
        *evidence
    )
    headline += "; the others give no evidence at this scale"
    headline += f" ({found['note']})" if "note" in found else ""
    return (
        f"| all of it, {found['cores']} cores | {command} | {found['seconds']:.0f} | {headline} |"
    )


def main() -> None:
    readme, table = ROOT / "README.md", make_table(json.loads(RESULTS.read_text()))
    readme.write_text(MARKS.sub(lambda found: f"{found[1]}{table}{found[2]}", readme.read_text()))


if __name__ == "__main__":
    main()
