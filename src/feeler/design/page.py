"""What a plan came to as one page: the best antennas beside the reference, what they discriminate,
and how sure.
"""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna.segments import Antenna, compute_modes
from feeler.design.plan import WIDEST, DesignOutcome, make_strips
from feeler.design.scoring import Score
from feeler.errors import MissingDependencyError
from feeler.files import ensure_folder
from feeler.objects.trials import Trial
from feeler.physics.contact import get_contact
from feeler.plotting.style import PALETTE
from feeler.report import Section, write_page
from feeler.validation import checked

_LEAD = (
    "The touches were drawn three times. The search used the first draws; the second, the test"
    " draws, chose among its results; the third, the final draws, were used when all was decided."
    " Bits are what one decoder knows of object and place in held-out touches; a better"
    " decoder may know more."
)


@checked
def write_design(
    found: DesignOutcome,
    out: Path,
    *,
    conditions: str = "",
    movie: bool = True,
    tolerance: list[Score] | None = None,
) -> Path:
    """``design.html`` in the folder ``out``, with its pictures beside it; ``tolerance`` adds the
    robot's hinges.
    """
    section = Section(
        name="design", title="The best antennas", folder=ensure_folder(out), vector=False
    )
    answer = _say_result(found, section)
    section.figure(
        "profiles",
        "Stiffness (strokes: sensors) and damping of the best antenna of each start (colours) and"
        " of the reference (black; in space dashed: towards z), the damping ratios of the first"
        " modes, and the fewest missing bits during each search.",
        lambda figure: _plot_designs(found, figure),
        height=4.6,
    )
    section.figure(
        "confusion",
        "Which touch is named as which, on the final draws: rows are touches, columns answers; the"
        " objects at each place stand together.",
        lambda figure: _plot_answers(found, figure),
        height=3.4,
    )
    if movie:
        _add_movie(found, section, out)
    if tolerance:
        _say_making(found, section, tolerance)
    section.text(conditions)
    section.text(_LEAD)
    return write_page(out / "design.html", "Best antennas of a design", answer, section)


def _say_result(found: DesignOutcome, section: Section) -> str:
    """The table of designs, and the result in one sentence."""
    fewer, error = found.compare()
    sure = (
        f"{100 * fewer:.0f} ± {100 * error:.0f} % (standard error)"
        if np.isfinite(fewer)
        else "undefined (no errors)"
    )
    looks = (
        "The final draws were looked at once."
        if found.looks == 1
        else (
            f"{found.looks} designs have been judged on these draws, so that the best of them looks"
            " better than it is: for a claim take a new final seed."
        )
    )
    mine, other = (
        f"{100 * s.errors:.1f} ± {100 * s.errors_error:.1f} %"
        for s in (found.final, found.reference_final)
    )
    section.text(looks)
    rows: list[list[object]] = [
        ["reference", *_list_cells(found.reference_test, found.plan.reference), "", "", ""]
    ]
    for k, (end, test) in enumerate(zip(found.ends, found.tests, strict=True)):
        counts = Counter(end.counts)
        rows.append(
            [
                f"design {k + 1}",
                *_list_cells(test, end.design.antenna),
                end.best.bits,
                counts["simulated"],
                f"{counts['excluded']} excluded, {counts['diverged']} diverged,"
                f" {counts['peak']} too bent",
            ]
        )
    section.table(
        [
            "test draws",
            "bits",
            "± SE",
            "wrong [%]",
            "peak [rad]",
            "least damping ratio",
            "bits, search's draws",
            "simulated",
            "other candidates",
        ],
        rows,
        f"At most {np.log2(found.plan.task.n_classes):.2f} bits. Where bits are"
        " much higher on the search's draws than on the test draws, the search has fitted"
        " its own draws.",
    )
    return (
        f"On the final draws the best antenna classifies {mine} of noisy touches incorrectly, the"
        f" reference {other}: errors avoided {sure}."
    )


def _list_cells(one: Score, antenna: Antenna) -> list[object]:
    least = compute_modes(antenna, 6).damping_ratio.min()
    return [one.bits, one.bits_error, 100 * one.errors, one.peak, float(least)]


def _plot_designs(found: DesignOutcome, figure: Figure) -> None:
    """Four panels; in space dashed what bends towards z."""
    axes = figure.subplots(2, 2).flat
    shown = [(found.plan.reference, "black", "reference")]
    shown += [
        (e.design.antenna, c, f"design {k + 1}")
        for k, (e, c) in enumerate(zip(found.ends, PALETTE, strict=False))
    ]
    for antenna, colour, label in shown:
        place = antenna.hinge_position / antenna.length
        stiffness, damping = (
            np.atleast_2d(x)[:2] for x in (antenna.stiffness, antenna.damping)
        )
        for ls, row, lost in zip(("-", "--"), stiffness, damping, strict=False):
            axes[0].plot(place, row, ls, color=colour, label=label if ls == "-" else None)
            axes[1].plot(place, lost, ls, color=colour)
        at = antenna.sensors - 1
        axes[0].plot(place[at], stiffness[0, at], "|", color=colour, ms=3)
        ratio = compute_modes(antenna, 6).damping_ratio
        axes[2].plot(np.arange(1, ratio.size + 1), ratio, "o-", ms=3, color=colour)
    for end, colour in zip(found.ends, PALETTE, strict=False):
        count, cost = np.array(end.history).T
        keep = cost < np.log2(found.plan.task.n_classes)
        axes[3].step(count[keep], cost[keep], where="post", color=colour)
    along = "position (base 0, tip 1)"
    axes[0].set(xlabel=along, ylabel="stiffness [N·mm/rad]", yscale="log")
    axes[1].set(xlabel=along, ylabel="damping [N·mm·ms/rad]", yscale="log")
    axes[2].set(xlabel="mode", ylabel="damping ratio", yscale="log")
    axes[3].set(xlabel="antennas simulated", ylabel="missing bits")
    marks = axes[0].get_legend_handles_labels()
    figure.legend(*marks, loc="outside lower center", ncols=len(shown))


def _plot_answers(found: DesignOutcome, figure: Figure) -> None:
    """Reference and best side by side, on one scale."""
    axes = figure.subplots(1, 2, sharey=True)
    for ax, one, title in zip(
        axes, (found.reference_final, found.final), ("reference", "design 1"), strict=True
    ):
        image = ax.imshow(one.confusion, vmin=0, vmax=1, interpolation="nearest")
        ax.set(
            title=f"{title}: {one.bits:.2f} bits, {100 * one.errors:.1f} % wrong",
            xlabel="answer",
        )
        n_objects, n_places = len(found.plan.task.objects), len(found.plan.task.locations)
        middle = n_objects * (np.arange(n_places) + 0.5) - 0.5
        names = [f"{place:g}" for place in found.plan.task.locations]
        ax.set_xticks(middle, names)
        ax.set_yticks(middle, names)
    axes[0].set_ylabel("object × place [length]")
    figure.colorbar(image, ax=axes, label="share")


def _add_movie(found: DesignOutcome, section: Section, out: Path) -> None:
    """One touch of the best antenna, or a line that says how to get it."""
    from feeler.experiments.tactile import touch
    from feeler.plotting import write_touch_movie

    task = found.task
    trial = Trial(
        feature=task.objects[0],
        location=task.locations[len(task.locations) // 2],
        speed=task.speeds[0],
    )
    step = get_contact(None, found.best).scale_timestep(task.timestep)
    everything = touch(
        found.best, trial, duration=task.duration, timestep=step, all_hinges=True
    )
    try:
        path = write_touch_movie(found.best, trial, everything, out / "touch.mp4")
    except MissingDependencyError as missing:
        section.text(f"No movie: {missing}")
        return
    section.movie(path, f"The best antenna touched: {trial.label}.")


def _say_making(found: DesignOutcome, section: Section, tolerance: list[Score]) -> None:
    section.heading("As flexures")
    made = found.plan.constraints
    strips = make_strips(found.best, made)
    rows = [
        [
            k + 1,
            float(found.best.stiffness[k]),
            float(strips.width[k]),
            float(strips.thickness[k]),
        ]
        for k in range(found.best.n_segments)
    ]
    low, high = made.width or (made.hinge_length, WIDEST)
    broken = int(np.sum((strips.width > high) | (strips.width < low)))
    note = f" {broken} of them cannot be cut from any such sheet." if broken else ""
    section.table(
        ["hinge", "stiffness [N·mm/rad]", "width [mm]", "sheet [mm]"],
        rows,
        f"Strips {made.hinge_length:g} mm long and {low:g} to {high:g} mm wide, of"
        f" {made.modulus:g} MPa, w = 12 k ℓ / (p1 E t³) with p1 = {made.stiffness_factor:g}, of the"
        f" thickest sheet that fits.{note}",
    )
    errors: Any = np.array([one.errors for one in tolerance])
    bits: Any = np.array([one.bits for one in tolerance])
    section.text(
        f"Made 5 % wrong (width and thickness of each hinge, {len(tolerance)} copies, test draws):"
        f" {100 * errors.mean():.1f} % wrong ({100 * errors.min():.1f} to {100 * errors.max():.1f})"
        f" in place of {100 * found.tests[0].errors:.1f} %, {bits.mean():.3f} bits in place of"
        f" {found.tests[0].bits:.3f}."
    )
