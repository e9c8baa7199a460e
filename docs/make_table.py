"""The table of docs/figures.md (figure → command → seconds → headline), and the result that README
and the docs' home show, made from benchmarks/results/reproduce.json.

python docs/make_table.py    writes them.
"""

import json
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "reproduce.json"
HEADLINES = {
    "The antenna": ("Fig. 2A, C", "{antenna.n_segments:.0f} segments"),
    "Calibration: does the model move like the animal?": (
        "Fig. 2B, S1, Movie S1",
        "{calibration.frequency:.1f} Hz damped tip frequency, published constants",
    ),
    "Tactile tensors": (
        "Fig. 2D–E, S3, Movie S2",
        "{tensors.count:.0f} tensors of one antenna",
    ),
    "Design axes: spacing, sampling, compliance": (
        "Fig. 1",
        "location accuracy {axes.place.every 14:.0%} with every 14th sensor,"
        " {axes.place.every 1:.0%} with all",
    ),
    "Wall distance": (
        "Fig. 3, Movie S3",
        "curvature follows wall distance in the paper's order of antennas in"
        " {wall.family.order:.0%} of the configurations with a map",
    ),
    "Encoding": (
        "Fig. 4, 5F–G, S5",
        "contact location predicts the dominant basis: p = {encoding.location_p:.3f}",
    ),
    "Dispersion and classification": (
        "Fig. 5A–E, S6",
        "similarity (NMI) of a slow touch (0.06 m/s) and its nearest neighbour:"
        " {dispersion.tensor.nmi.slow:.2f}, in 380 ms",
    ),
    "Convolutional network": (
        "Fig. S4",
        "accuracy for slow touches (0.06 m/s): {cnn.slow:.2f}, noise of 10, 20 and 30 % of"
        " the peak",
    ),
    "Beyond the paper: speed against accuracy against energy": (
        "beyond",
        "mutual information of an untruncated touch and its class (of 4.91 bits):"
        " {tradeoff.whole.common.slowest:.2f} at the slowest speed (0.03 m/s) and"
        " {tradeoff.whole.common.fastest:.2f} at the fastest (1.2 m/s), noise of"
        " {choices.common:g} rad",
    ),
    "Beyond the paper: what the gradient does": (
        "beyond",
        "mutual information {gradient.fastest.common.-0.0827:.2f} bits with the published gradient"
        " of stiffness, {gradient.fastest.common.0:.2f} with none, at 0.3 m/s, noise of"
        " {choices.common:g} rad",
    ),
    "Beyond the paper: which receptor noise makes the gradient best": (
        "beyond",
        "no receptor-noise model favours the published gradient (best case"
        " {receptor.fine.lead.sample:.1f} points against the best other one), at 0.3 m/s",
    ),
    "Beyond the paper: place, size and speed beside their bounds": (
        "beyond",
        "location error of the best estimator"
        " {bounds.error.location.common.0.003:.2f} mm (RMS), at 0.24 to 0.36"
        " m/s, noise of 0.003 rad",
    ),
    "Beyond the paper: which antenna tells most": (
        "beyond",
        "{design.fewer.0.3:.0%} fewer errors by searched profiles at 0.3 m/s,"
        " {design.fewer.0.06:.1%} at 0.06 m/s, noise of one peak",
    ),
    "Beyond the paper: an antenna designed for held-out sizes and locations": (
        "beyond",
        "error rate on held-out sizes and locations:"
        " {unseen.wrong.unseen.unseen:.1f} % with the antenna optimised for them,"
        " {unseen.wrong.published.unseen:.1f} % with the published one, at 0.3 m/s, noise of"
        " 0.3 peaks",
    ),
    "Beyond the paper: what a nerve says": (
        "beyond",
        "accuracy from spike counts: {spikes.right.exponential.slow.counts.own.whole_touch:.1f} %"
        " for slow touches (0.06 m/s), {spikes.right.exponential.fast.counts.own.whole_touch:.1f} %"
        " for fast ones (0.6 m/s), thirty classes, unknown location",
    ),
    "Beyond the paper: touched from out of the plane": (
        "beyond",
        "the published antenna leads the next best by {space.gradient:.0f} points when touched from"
        " within ± 60°, at 0.3 m/s, noise of 0.03 rad",
    ),
    "The robotic antenna": (
        "Fig. 6, S7, Movie S4",
        "accuracy {robot.transfer:.2f} for tip contacts of surrogate robots, reality gap of 1",
    ),
    "Active touch speed": ("Fig. S2", "{tracking.mean:.1f} °/s, synthetic tracks"),
}
AT_PAPER_SCALE = (
    "space",
    *("cnn", "tradeoff", "gradient", "receptor", "bounds", "design", "unseen", "spikes"),
)
"""What the default run shows from the kept one."""
PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
SCALES = ("smoke", "quick", "published", "paper")
_TOLD = ("reproduced", "partly", "not reproduced", "depends on a definition", "no evidence")
MARKS = re.compile(r"(<!-- figures: .*? -->\n).*(<!-- end of figures -->)", re.S)
ANTENNAS = {
    "exponential": "stiff base, soft tip (exponential)",
    "linear": "stiffness falls linearly",
    "constant": "same stiffness everywhere (constant)",
}
CHANCE = 1 / 30
RESULT_MARKS = re.compile(r"(<!-- result: .*? -->\n).*(<!-- end of result -->)", re.S)
RESULT_PAGES = ("README.md", "docs/index.md")
"""Where the one result stands."""


def make_result(results: dict) -> str:
    """The one result, from the run at paper scale: accuracy of each antenna in both kinds of noise,
    what the absolute one is a share of, and what follows for the gradient.
    """
    values = _collect(results["paper"])
    peaks = {name: values[f"complete.peak.{name}"] for name in ANTENNAS}
    loudest = max(peaks, key=peaks.__getitem__)
    rows = {
        "common": f"absolute: 5 to 30 % of {peaks[loudest]:.3f} rad, on every antenna",
        "relative": "relative: 5 to 30 % of each touch's own peak (the paper's kind)",
    }
    lines = [
        f"| noise | {' | '.join(ANTENNAS.values())} | chance |",
        "|---" * (len(ANTENNAS) + 2) + "|",
    ]
    for noise, words in rows.items():
        cells = [
            fill(f"{{complete.{noise}.{name}:{'.0%' if noise == 'common' else '.1%'}}}", values)
            for name in ANTENNAS
        ]
        lines.append(f"| {words} | {' | '.join(cells)} | {CHANCE:.0%} |")
    shares = " and ".join(
        f"{0.05 * peaks[loudest] / peak:.0%} to {0.3 * peaks[loudest] / peak:.0%} of the {name}"
        " antenna's"
        for name, peak in peaks.items()
        if name != loudest
    )
    gains = {
        noise: values[f"complete.{noise}.exponential"]["low"]
        > values[f"complete.{noise}.constant"]["high"]
        for noise in rows
    }
    said = {True: "the gradient of stiffness helps", False: "no advantage can be shown"}
    return "\n".join(
        [
            *lines,
            "",
            f"The absolute noise is a share of the largest angle of any antenna, the {loudest}"
            " one's:",
            f"{shares} own largest angle. In absolute noise {said[gains['common']]};",
            f"in noise relative to each touch {said[gains['relative']]}"
            " over constant stiffness.",
            "",
        ]
    )


def _collect(found: dict) -> dict:
    return {key: value for part in found["values"].values() for key, value in part.items()}


def make_table(results: dict) -> str:
    """The table's lines, all from the run at paper scale, and a line for every scale."""
    found = results["paper"]
    values = _collect(found)
    lines = ["| figure | command | seconds | headline |", "|---|---|---|---|"]
    for title, (figures, words) in HEADLINES.items():
        keys = {key for key, _ in PLACE.findall(words)}
        beyond = {key.partition(".")[0] for key in keys} & {*AT_PAPER_SCALE}
        seconds = found["stages"].get(title)
        whole = keys <= {key for key, value in values.items() if value is not None}
        lines.append(
            f"| {figures} | {_name_command('paper' if beyond else 'published')} |"
            f" {'–' if seconds is None else f'{seconds:.0f}'} |"
            f" {fill(words, values) if whole else '–'} |"
        )
    totals = [_make_total(scale, results[scale]) for scale in SCALES if scale in results]
    return "\n".join(lines + totals) + "\n"


def fill(words: str, values: dict) -> str:
    """The words with each number and, behind it, ± half its spread, or of how many it is one."""

    def show(found: re.Match) -> str:
        value, form = values[found[1]], found[2]
        if not isinstance(value, dict):
            return format(value, form)
        number = format(value["value"], form)
        if value.get("low") is not None:
            return f"{number} ± {format((value['high'] - value['low']) / 2, form)}"
        return f"{number} (n = {value['n']})" if "n" in value else number

    return PLACE.sub(show, words)


def _make_total(scale: str, found: dict) -> str:
    claims = found["claims"]["paper"]
    told = [f"{claims[word]} {word}" for word in _TOLD if claims.get(word)]
    rest = sum(claims.values()) - sum(claims.get(word, 0) for word in _TOLD)
    headline = (
        f"of {sum(claims.values())} statements {', '.join(told)}; {rest} without a verdict"
    )
    headline += f" ({found['note']})" if "note" in found else ""
    return (
        f"| all of it, {found['cores']} cores | {_name_command(scale)} | {found['seconds']:.0f} |"
        f" {headline} |"
    )


def _name_command(scale: str) -> str:
    return "`make reproduce`" if scale == "published" else f"`make reproduce SCALE={scale}`"


def main() -> None:
    results = json.loads(RESULTS.read_text())
    _write("docs/figures.md", MARKS, make_table(results))
    for page in RESULT_PAGES:
        _write(page, RESULT_MARKS, make_result(results))


def _write(page: str, marks: re.Pattern, made: str) -> None:
    """Put what was made between its marks."""
    path = ROOT / page
    path.write_text(marks.sub(lambda found: f"{found[1]}{made}{found[2]}", path.read_text()))


if __name__ == "__main__":
    main()
