"""Calibration: step and impulse, what the fit determines, segment lengths."""

import numpy as np

from feeler.paper import calibration_report, fig2b, figS1, movie_s1
from feeler.paper.context import Context
from feeler.paper.section import Section

NAMES = ("frequency [Hz]", "damping ratio", "ratio 71 %", "ratio 86 %")


def make(context: Context, section: Section) -> None:
    """Fig. 2B, Movie S1, Fig. S1, the calibration's tables and what it determines."""
    _show_traces(context, section)
    _show_calibration(context, section)
    _show_segments(context, section)


def _show_traces(context: Context, section: Section) -> None:
    data = fig2b.compute(context.antenna, engine=context.engine)
    section.figure(
        "fig2b_step_impulse",
        "Tip displacement after a step release (10 mm from the fixation) and during an impulse at 95 % of the "
        "length, against points digitised from the first author's poster [A]. Speed and lever of the impactor "
        "are not published [C]; the ±SD bands of the animals could not be read. (Fig. 2B)",
        lambda figure: fig2b.plot(data, figure),
    )
    section.numbers("fig2b_step_impulse", step_time=data.step_time, step=data.step, impulse=data.impulse)
    section.text(
        "The simulated step passes the digitised points of the published simulation within "
        f"{data.step_deviation:.3f} of the step (root mean square), the impulse within "
        f"{data.impulse_deviation:.3f}. ζ is {data.free.damping_ratio:.3f} by logarithmic decrement and "
        f"{data.free.fitted_damping_ratio:.3f} by a damped cosine over the whole record: another definition, another number."
    )
    section.values |= {
        "calibration.rejected": data.free.rejected,
        "calibration.damping_fitted": data.free.fitted_damping_ratio,
        "calibration.settle_10": data.free.settle_10,
        "calibration.step_deviation": data.step_deviation,
        "calibration.impulse_deviation": data.impulse_deviation,
    }
    if context.scale != "smoke":
        path = movie_s1.write(context.antenna, data, section.folder / "movie_s1.mp4")
        section.movie(path, "The impulse test, slowed down. (Movie S1)")


def _show_calibration(context: Context, section: Section) -> None:
    result = calibration_report.compute(
        context.scale, antenna=context.antenna, seed=context.seed, engine=context.engine
    )
    measured, error, accuracy = result.published
    section.heading("Calibration")
    section.text(
        "The paper's targets (Table 1) are lost. These are reconstructed from what the published optimum itself "
        "yields and from the poster's traces, so the small error of the published constants is no evidence for them."
    )
    rows = [
        ["paper, its own targets", *["lost"] * 4, calibration_report.PAPER_ERROR, calibration_report.PAPER_ACCURACY]
    ]
    rows.append(["published p1…p4 here", *_list(measured), error, accuracy])
    if result.refits is not None:
        fit = result.refits
        p = ", ".join(f"{value:.4g}" for value in fit.p)
        rows.append([f"refit: {p}", *_list(fit.measured), fit.error, fit.symmetric_accuracy])
    rows += [[f"preset {name}", *_list(m), e, a] for name, (m, e, a) in result.presets.items()]
    rows += [
        [f"refit {name}", *_list(f.measured), f.error, f.symmetric_accuracy] for name, f in result.controls.items()
    ]
    section.table(
        ("antenna", *NAMES, "error", "MSA"),
        rows,
        "Normalised distance and median symmetric accuracy against the targets.",
    )
    if result.compared:
        table = [[m.method, m.evaluations, m.seconds, m.error] for m in result.compared]
        section.table(
            ("optimiser", "evaluations", "seconds", "error"), table, "One start, at most 150 evaluations each."
        )
    if result.ratios:
        table = [[v, "straight" if lever is None else f"{lever:g} mm", *r] for v, lever, r in result.ratios]
        caption = (
            "The impactor's speed and path are not published; what they do to the ratios of the published constants."
        )
        section.table(("speed [m/s]", "path", *NAMES[2:]), table, caption)
    _show_identifiability(result, section)
    section.values |= {
        "calibration.frequency": float(measured.values[0] * 1e3),
        "calibration.damping_ratio": float(measured.values[1]),
        "calibration.ratio_71": float(measured.values[2]),
        "calibration.ratio_86": float(measured.values[3]),
        "calibration.cost_published": error,
        "calibration.msa_published": accuracy,
        "calibration.widest_spread": result.widest_spread,
        **{f"calibration.error_{name}": e for name, (_, e, _) in result.presets.items()},
    }


def _list(measured: calibration_report.Measured) -> list[float]:
    return [measured.values[0] * 1e3, *measured.values[1:]]


def _show_identifiability(result: calibration_report.Calibration, section: Section) -> None:
    low, high = np.quantile(result.draws, (0.025, 0.975), axis=0)
    names = result.directions.names
    intervals = "; ".join(f"{n} {a:.3g} to {b:.3g}" for n, a, b in zip(names, low, high, strict=True))
    section.text(
        f"{result.directions.describe()} Bootstrap over the animals' spread (means of 5; 95 %; along determined "
        f"directions only): {intervals}. Among fits at least as good as the paper's 0.067, one parameter differs "
        f"by a factor of {result.widest_spread:.2g}."
    )
    section.figure(
        "calibration_directions",
        "How strongly the four targets determine combinations of p1…p4, and what each combination is made of.",
        lambda figure: calibration_report.plot_directions(result.directions, figure),
        height=2.4,
    )
    if result.profiles is not None:
        section.figure(
            "calibration_profiles",
            "Error when one parameter is held and the others are refitted; dashed: the paper's 0.067.",
            lambda figure: calibration_report.plot_profiles(result.profiles, figure),
            height=2.2,
        )


def _show_segments(context: Context, section: Section) -> None:
    data = figS1.compute(seed=context.seed)
    section.figure(
        "figS1_segments",
        "Sigmoid through segment lengths: four synthetic antennae scattered about the default one, because the "
        "measured lengths were not published. (Fig. S1)",
        lambda figure: figS1.plot(data, figure),
        width=3.5,
    )
    section.values["calibration.sigmoid_residual"] = data.fit.squared_residual
