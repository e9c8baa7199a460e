"""The flagellum of Periplaneta americana: every number with its source."""

from functools import cache

import numpy as np

from feeler.antenna.antenna import Antenna, make_even_sensors
from feeler.antenna.fact import PAPER, Fact
from feeler.antenna.modes import compute_modes
from feeler.antenna.parse import Source
from feeler.antenna.profile import Constant, Exponential, Linear, Sigmoid
from feeler.errors import InvalidInput
from feeler.records.checked import checked

_LINEAR = (
    "fitted to the reconstructed targets, no hinge softer than the exponential tip: error 1.60"
    " (18.4 Hz, ζ 0.55; deflection ratios 0.56 and 0.77 instead of 0.22 and 0.55)"
)
_CONSTANT = (
    "fitted to the reconstructed targets: error 1.89 (17.8 Hz, ζ 0.54; deflection ratios 0.62 and"
    " 0.82 instead of 0.22 and 0.55)"
)

FACTS: dict[str, Fact] = {
    "n_segments": Fact(
        value=140, unit="1", tag="P+A", note="rigid links, hinge n proximal to link n"
    ),
    "length": Fact(
        value=42.0, unit="mm", tag="D", note="±0.5; the proximal 5 mm are held in forceps"
    ),
    "segment_length_low": Fact(
        value=0.00349, unit="1/length", tag="D", note="sigmoid of the length share; form [P]"
    ),
    "segment_length_rise": Fact(value=0.00588, unit="1/length", tag="D"),
    "segment_length_slope": Fact(value=11.06, unit="1", tag="D"),
    "segment_length_centre": Fact(value=0.377, unit="1", tag="D"),
    "collision_radius": Fact(
        value=0.225, unit="mm", tag="D", note="constant [P]; 0.22 to 0.23 [D]"
    ),
    "radius_base": Fact(
        value=0.20,
        unit="mm",
        tag="D",
        note="of the mass profile; (0.15, 0.055) and (0.25, 0.049) fit too",
    ),
    "radius_tip": Fact(
        value=0.052, unit="mm", tag="D", note="of the mass profile; well constrained"
    ),
    "density": Fact(value=1.1e-3, unit="g/mm³", tag="D", note="constant [P]"),
    "stiffness_base": Fact(value=37.78, unit="N·mm/rad", tag="P", note="p1; unit [D]"),
    "stiffness_rate": Fact(value=-0.0827, unit="1/joint", tag="P", note="p3; equation [A]"),
    "damping_base": Fact(value=25.24, unit="N·mm·ms/rad", tag="P", note="p2; unit [D]"),
    "damping_rate": Fact(value=-0.0533, unit="1/joint", tag="P", note="p4; equation [A]"),
    "n_sensors": Fact(
        value=56,
        unit="1",
        tag="P",
        note="their places are not published [C]: evenly spaced in segment number",
    ),
    "linear_stiffness_base": Fact(value=0.572, unit="N·mm/rad", tag="D+C", note=_LINEAR),
    "linear_stiffness_tip": Fact(value=3.85e-4, unit="N·mm/rad", tag="D+C", note=_LINEAR),
    "linear_damping_base": Fact(value=4.44, unit="N·mm·ms/rad", tag="D+C", note=_LINEAR),
    "linear_damping_tip": Fact(value=0.0176, unit="N·mm·ms/rad", tag="D+C", note=_LINEAR),
    "constant_stiffness": Fact(value=0.395, unit="N·mm/rad", tag="D+C", note=_CONSTANT),
    "constant_damping": Fact(value=3.17, unit="N·mm·ms/rad", tag="D+C", note=_CONSTANT),
}

PROFILE_NAMES = ("exponential", "linear", "constant", "matched")


@checked
def cockroach(profile: str = "exponential", *, sensors: str = "even") -> Antenna:
    """The cockroach antenna, or a control that shares everything but its hinges.

    Parameters
    ----------
    profile
        ``exponential``: the published fit. ``linear``, ``constant``: their own stiffness and
        damping, fitted to the same targets; neither can meet the deflection ratios. ``matched``:
        constant stiffness with the same total compliance Σ 1/k_n, so that profile and overall
        softness are not confounded.
    sensors
        ``even`` (56 over all hinges), ``distal`` (every second hinge of the distal 112) or ``all``
        [C].

    Returns
    -------
    Antenna
        140 segments, 42 mm, named after the profile.
    """
    if profile not in PROFILE_NAMES:
        raise InvalidInput(f"unknown profile {profile!r}; valid: {', '.join(PROFILE_NAMES)}.")
    return _make(profile, sensors)


def list_sources(profile: str) -> dict[str, Source]:
    """Formulas and sources of the quantities of :func:`cockroach`, in few words; none for other
    antennas.
    """
    if profile not in PROFILE_NAMES:
        return {}
    low, rise, slope, centre = (
        _v(f"segment_length_{part}") for part in ("low", "rise", "slope", "centre")
    )
    share = f"{low!r} + {rise!r} / (1 + exp(-{slope!r} * (x - {centre!r})))"
    base, tip = _v("radius_base"), _v("radius_tip")
    sources = {
        "segment_length": (
            "D",
            "length and its sigmoid share; the form is [P]",
            f"spread({_v('length')!r}, {share})",
        ),
        "segment_mass": (
            "D",
            "constant density [P], radius falling exponentially",
            f"{_v('density')!r} * pi * ({base!r} * ({tip!r} / {base!r}) ** s) ** 2 * l",
        ),
        "radius": ("D", "collision radius; constant [P]", ""),
        "sensors": ("C", "56 sensors are [P], their places are not published", ""),
    }
    for name in ("stiffness", "damping"):
        if profile == "exponential":
            base, rate = _v(f"{name}_base"), _v(f"{name}_rate")
            sources[name] = (
                "P",
                "exponential fit; its unit is [D]",
                f"{base!r} * exp({rate!r} * (n - 1))",
            )
        else:
            sources[name] = (
                "C",
                f"control profile {profile!r}, matched to the exponential antenna",
                "",
            )
    return {
        name: Source(tag=tag, reference=PAPER, note=note, formula=formula)
        for name, (tag, note, formula) in sources.items()
    }


@cache  # an antenna cannot be changed, so one may serve all who ask
def _make(profile: str, sensors: str) -> Antenna:
    n = int(_v("n_segments"))
    exponential = Antenna(
        segment_length=_segment_length(n),
        segment_mass=_segment_mass(n),
        radius=np.full(n, _v("collision_radius")),
        stiffness=Exponential(base=_v("stiffness_base"), rate=_v("stiffness_rate")).sample(n),
        damping=Exponential(base=_v("damping_base"), rate=_v("damping_rate")).sample(n),
        sensors=_sensors(sensors, n),
        name="exponential",
    )
    return exponential if profile == "exponential" else _control(exponential, profile)


def _v(name: str) -> float:
    return FACTS[name].number


def _segment_length(n: int) -> np.ndarray:
    sigmoid = Sigmoid(
        low=_v("segment_length_low"),
        rise=_v("segment_length_rise"),
        slope=_v("segment_length_slope"),
        centre=_v("segment_length_centre"),
    )
    share = sigmoid.sample(n)
    return _v("length") * share / share.sum()


def _segment_mass(n: int) -> np.ndarray:
    """Constant density, radius falling exponentially with arc length [P form, D numbers]."""
    length = _segment_length(n)
    x = (np.cumsum(length) - length / 2) / length.sum()
    radius = _v("radius_base") * (_v("radius_tip") / _v("radius_base")) ** x
    return _v("density") * np.pi * radius**2 * length


def _sensors(placement: str, n: int) -> np.ndarray:
    placements = {
        "even": make_even_sensors(n, int(_v("n_sensors"))),
        "distal": np.arange(n - 111, n + 1, 2),
        "all": np.arange(1, n + 1),
    }
    if placement not in placements:
        raise InvalidInput(
            f"unknown sensor placement {placement!r}; valid: {', '.join(placements)}."
        )
    return placements[placement]


def _control(exponential: Antenna, profile: str) -> Antenna:
    n = exponential.n_segments
    if profile == "matched":
        stiffness = Constant(value=n / np.sum(1 / exponential.stiffness)).sample(n)
        return match_damping(
            exponential.replace(stiffness=stiffness, name=profile), exponential
        )
    family, names = (
        (Constant, ("value",)) if profile == "constant" else (Linear, ("base", "tip"))
    )

    def sample(quantity: str) -> np.ndarray:
        keys = [
            f"{profile}_{quantity}" if name == "value" else f"{profile}_{quantity}_{name}"
            for name in names
        ]
        return family(**{name: _v(key) for name, key in zip(names, keys, strict=True)}).sample(
            n
        )

    return exponential.replace(
        stiffness=sample("stiffness"), damping=sample("damping"), name=profile
    )


def match_damping(control: Antenna, reference: Antenna) -> Antenna:
    """Damping proportional to stiffness; the first mode's damping ratio is the reference's."""
    trial = control.replace(damping=control.stiffness)
    share = (
        compute_modes(reference, 1).damping_ratio[0] / compute_modes(trial, 1).damping_ratio[0]
    )
    return trial.replace(damping=trial.damping * share)
