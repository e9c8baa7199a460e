"""The antenna: morphology, profiles, sources of its numbers."""

from feeler.antenna.cockroach import FACTS
from feeler.antenna.fact import SOURCE_TAGS
from feeler.antenna.modes import compute_modes
from feeler.paper import fig2
from feeler.paper.context import Context
from feeler.report.section import Section


def make(context: Context, section: Section) -> None:
    """Draw the antenna (Fig. 2A, C), list its numbers with their sources, and its small oscillations."""
    antenna = context.antenna
    section.figure(
        "fig2c_antenna",
        f"The antenna '{antenna.name}' and what changes along it. Dots: sensors. Inertia is that of thin rods with the "
        "shown masses; the drawn radius enters contact only. (Fig. 2A, C)",
        lambda figure: fig2.plot_antenna(antenna, figure),
        height=3.2,
    )
    section.numbers(
        "fig2c_antenna",
        segment_length=antenna.segment_length,
        segment_mass=antenna.segment_mass,
        stiffness=antenna.stiffness,
        damping=antenna.damping,
    )
    rows = []
    for name, control in context.profiles.items():
        modes = compute_modes(control, 2)
        rows.append([name, *(1e3 * modes.frequency[:2]), modes.damping_ratio[0], float((1 / control.stiffness).sum())])
    section.table(
        ["profile", "mode 1 [Hz]", "mode 2 [Hz]", "ζ of mode 1", "Σ 1/k [rad/N·mm]"],
        rows,
        "Undamped small oscillations of the clamped, straight antenna.",
    )
    section.values |= {"antenna.n_segments": antenna.n_segments, "antenna.n_sensors": int(antenna.sensors.size)}
    if context.is_cockroach:
        _list_facts(section)


def _list_facts(section: Section) -> None:
    section.heading("Where the numbers come from")
    section.text("; ".join(f"[{tag}] {meaning}" for tag, meaning in SOURCE_TAGS.items()) + ".")
    section.table(
        ["quantity", "value", "unit", "source", "note"],
        [[name, fact.value, fact.unit, f"[{fact.tag}]", fact.note] for name, fact in FACTS.items()],
    )
