"""The table of docs/figures.md (figure → command → seconds → headline), and the result that README
and the docs' home show: views of the table of the cached run, paper/kept/results.csv, and of the
times in benchmarks/results/reproduce.json.

python -m docs.make_table    writes them.
"""

import json
import re
from pathlib import Path

from paper.readings import WORDS
from paper.table import KEPT, PLACE, Results, fill_front, read_declared

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
    "Beyond the paper: amplitude or geometry": (
        "beyond",
        "lead of the graded over a uniform antenna, linear classifier, held-out touches, 0.3 m/s,"
        " absolute noise: {amplitude.gain.medium.absolute.narrow.linear.refitted.as_is:.1f} points;"
        " at equal r.m.s. {amplitude.gain.medium.absolute.narrow.linear.refitted.rms:.1f}, at equal"
        " peak {amplitude.gain.medium.absolute.narrow.linear.refitted.peak:.1f}",
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
    *("space", "cnn", "tradeoff", "gradient", "receptor", "amplitude"),
    *("bounds", "design", "unseen", "spikes"),
)
"""What the default run shows from the kept one."""
SCALES = ("smoke", "quick", "published", "paper")
MARKS = re.compile(r"(<!-- figures: .*? -->\n).*(<!-- end of figures -->)", re.S)
RESULT_MARKS = re.compile(r"(<!-- result: .*? -->\n).*(<!-- end of result -->)", re.S)
RESULT_PAGES = ("README.md", "docs/index.md")
"""Where the one result stands."""


def make_result(results: Results, counts: dict[str, int]) -> str:
    """The answers with which the report begins, with one table, and the paper's verdicts."""
    lines = []
    for one in read_declared("statements.toml")["answer"]:
        lines += ["", f"**{one['asks']}** {results.fill(one['words'])}"]
        if one.get("table"):
            head, *rows = fill_front(results) or [[""]]
            lines += [
                "",
                *(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)),
            ]
    able = [f"{counts.get(word, 0)} {word}" for word in WORDS[:-1]]
    total = sum(counts.values())
    shown = total - counts.get(WORDS[-1], 0)
    lines += [
        "",
        f"**And the paper?** Of its {total} statements {shown} can be compared: {', '.join(able)}.",
    ]
    return "\n".join(lines) + "\n"


def make_table(times: dict, results: Results) -> str:
    """The table's lines, all from the run at paper scale, and a line for every scale."""
    found = times["paper"]
    lines = ["| figure | command | seconds | headline |", "|---|---|---|---|"]
    for title, (figures, words) in HEADLINES.items():
        keys = {key for key, _ in PLACE.findall(words)}
        beyond = {key.partition(".")[0] for key in keys} & {*AT_PAPER_SCALE}
        seconds = found["stages"].get(title)
        whole = all(results.get(key) for key in keys)
        lines.append(
            f"| {figures} | {_name_command('paper' if beyond else 'published')} |"
            f" {'–' if seconds is None else f'{seconds:.0f}'} |"
            f" {fill(words, results) if whole else '–'} |"
        )
    totals = [_make_total(scale, times[scale]) for scale in SCALES if scale in times]
    return "\n".join(lines + totals) + "\n"


def fill(words: str, results: Results) -> str:
    """The words with each number and, behind it, ± half its interval, or of how many it is one."""

    def show(found: re.Match) -> str:
        one, form = results.get(found[1]), found[2]
        assert one is not None
        number = format(one.value, form)
        if one.low < one.high:
            return f"{number} ± {format((one.high - one.low) / 2, form)}"
        return f"{number} (n = {one.n:.0f})" if one.n > 1 else number

    return PLACE.sub(show, words)


def _make_total(scale: str, found: dict) -> str:
    counts = found.get("verdicts", {"paper": {}})["paper"]
    told = [f"{n} {word}" for word, n in counts.items() if n]
    headline = f"of {sum(counts.values())} statements {', '.join(told)}" if counts else "–"
    headline += f" ({found['note']})" if "note" in found else ""
    return (
        f"| all of it, {found['cores']} cores | {_name_command(scale)} | {found['seconds']:.0f} |"
        f" {headline} |"
    )


def _name_command(scale: str) -> str:
    return "`make reproduce`" if scale == "published" else f"`make reproduce SCALE={scale}`"


def main() -> None:
    results = Results.read(KEPT)
    times = json.loads(RESULTS.read_text())
    _write("docs/figures.md", MARKS, make_table(times, results))
    for page in RESULT_PAGES:
        _write(
            page, RESULT_MARKS, make_result(results, times["published"]["verdicts"]["paper"])
        )


def _write(page: str, marks: re.Pattern, made: str) -> None:
    """Put what was made between its marks."""
    path = ROOT / page
    path.write_text(marks.sub(lambda found: f"{found[1]}{made}{found[2]}", path.read_text()))


if __name__ == "__main__":
    main()
