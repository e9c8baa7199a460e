"""Fig. 2A, C: the antenna, its profiles, and where its numbers come from."""

from matplotlib.figure import Figure

from feeler.antenna import Antenna, compute_modes
from feeler.antenna.files import SOURCE_TAGS
from feeler.plotting.antennas import plot_posture, plot_profiles
from feeler.plotting.style import ANTENNA_COLOURS, PALETTE, mark_panels
from feeler.presets import FACTS
from feeler.report.page import Section
from paper.context import Context


def plot(antenna: Antenna, figure: Figure) -> None:
    """The antenna lying, its sensors on it, and its profiles (Fig. 2A, C)."""
    grid = figure.add_gridspec(2, 4, height_ratios=(1, 2))
    ax = figure.add_subplot(grid[0, :])
    points = antenna.shape()[:, ::-1]
    radius, colour = antenna.radius, ANTENNA_COLOURS[1]
    ax.fill_between(points[:-1, 0], -radius, radius, color=colour, linewidth=0)
    plot_posture(points, ax, linewidth=1)
    ax.plot(
        points[antenna.sensors - 1, 0],
        points[antenna.sensors - 1, 1],
        ".",
        color=PALETTE[0],
        markersize=3,
        label="sensor",
    )
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0))
    ax.set(xlabel="arc length from the base [mm]", yticks=[], ylim=(-1.5, 1.5), aspect="equal")
    ax.set_title(
        f"{antenna.name}: {antenna.n_segments} segments, {antenna.sensors.size} sensors,"
        f" {antenna.length:.3g} mm"
    )
    ax.spines.left.set_visible(False)
    plot_profiles(antenna, [figure.add_subplot(grid[1, i]) for i in range(4)])
    mark_panels(figure.axes[:2], "ac")


def show(context: Context, section: Section) -> None:
    """Draw the antenna (Fig. 2A, C), list its numbers with their sources, and its small
    oscillations.
    """
    antenna = context.antenna
    section.figure(
        "fig2c_antenna",
        f"The antenna '{antenna.name}' and what changes along it. Dots: sensors. Inertia is that of"
        " thin rods with the shown masses; the drawn radius enters contact only. (Fig. 2A, C)",
        lambda figure: plot(antenna, figure),
        height=3.2,
        numbers={
            name: getattr(antenna, name)
            for name in ("segment_length", "segment_mass", "stiffness", "damping")
        },
    )
    rows = []
    for name, control in context.profiles.items():
        modes = compute_modes(control, 2)
        rows.append(
            [
                name,
                *(1e3 * modes.frequency[:2]),
                modes.damping_ratio[0],
                float((1 / control.stiffness).sum()),
            ]
        )
    section.table(
        ["profile", "mode 1 [Hz]", "mode 2 [Hz]", "ζ of mode 1", "Σ 1/k [rad/N·mm]"],
        rows,
        "Small oscillations of the clamped, straight antenna, the frequencies undamped. ζ is"
        " exact where damping is proportional to stiffness, as in 'uniform' and 'matched'; how"
        " the touched antenna decays is under Calibration. 'matched' is of uniform stiffness,"
        " with the total compliance Σ 1/k of 'exponential'.",
    )
    section.values |= {
        "antenna.n_segments": antenna.n_segments,
        "antenna.n_sensors": int(antenna.sensors.size),
    }
    if context.is_cockroach:
        _list_facts(section)


def _list_facts(section: Section) -> None:
    section.heading("Where the numbers come from")
    section.text("; ".join(f"[{tag}] {meaning}" for tag, meaning in SOURCE_TAGS.items()) + ".")
    section.table(
        ["quantity", "value", "unit", "source", "note"],
        [
            [name, fact.value, fact.unit, f"[{fact.tag}]", fact.note]
            for name, fact in FACTS.items()
        ],
    )
