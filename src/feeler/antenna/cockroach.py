"""The flagellum of Periplaneta americana: every number with its source."""

import numpy as np

from feeler.antenna.antenna import Antenna, make_even_sensors
from feeler.antenna.fact import Fact
from feeler.antenna.modes import compute_modes
from feeler.antenna.profile import Constant, Exponential, Linear, Sigmoid
from feeler.errors import InvalidInput

FACTS: dict[str, Fact] = {
    "n_segments": Fact(value=140, unit="1", tag="P+A", note="rigid links, hinge n proximal to link n"),
    "length": Fact(value=42.0, unit="mm", tag="D", note="±0.5; the proximal 5 mm are held in forceps"),
    "segment_length_low": Fact(value=0.00349, unit="1/length", tag="D", note="sigmoid of the length share; form [P]"),
    "segment_length_rise": Fact(value=0.00588, unit="1/length", tag="D"),
    "segment_length_slope": Fact(value=11.06, unit="1", tag="D"),
    "segment_length_centre": Fact(value=0.377, unit="1", tag="D"),
    "collision_radius": Fact(value=0.225, unit="mm", tag="D", note="constant [P]; 0.22 to 0.23 [D]"),
    "radius_base": Fact(value=0.20, unit="mm", tag="D", note="of the mass profile; (0.15, 0.055) and (0.25, 0.049) fit too"),
    "radius_tip": Fact(value=0.052, unit="mm", tag="D", note="of the mass profile; well constrained"),
    "density": Fact(value=1.1e-3, unit="g/mm³", tag="D", note="constant [P]"),
    "stiffness_base": Fact(value=37.78, unit="N·mm/rad", tag="P", note="p1; unit [D]"),
    "stiffness_rate": Fact(value=-0.0827, unit="1/joint", tag="P", note="p3; equation [A]"),
    "damping_base": Fact(value=25.24, unit="N·mm·ms/rad", tag="P", note="p2; unit [D]"),
    "damping_rate": Fact(value=-0.0533, unit="1/joint", tag="P", note="p4; equation [A]"),
    "n_sensors": Fact(value=56, unit="1", tag="P", note="their places are not published [C]: evenly spaced in segment number"),
    "linear_tip_share": Fact(value=0.01, unit="1", tag="C", note="provisional: k_140/k_1 of the linear profile"),
}

SENSOR_PLACEMENTS = ("even", "distal", "all")
PROFILE_NAMES = ("exponential", "linear", "constant", "matched")


def cockroach(profile: str = "exponential", *, sensors: str = "even") -> Antenna:
    """The cockroach antenna, or a control that shares everything but its hinges.

    Parameters
    ----------
    profile
        ``exponential``: the published fit. ``linear``, ``constant``: their own stiffness and damping level, matched to
        the exponential antenna in its first mode. ``matched``: constant stiffness with the same
        total compliance Σ 1/k_n, so that profile and overall softness are not confounded.
    sensors
        ``even`` (56 over all hinges), ``distal`` (every second hinge of the distal 112) or ``all`` [C].

    Returns
    -------
    Antenna
        140 segments, 42 mm, named after the profile.
    """
    if profile not in PROFILE_NAMES:
        raise InvalidInput(f"unknown profile {profile!r}; valid: {', '.join(PROFILE_NAMES)}.")
    n = int(FACTS["n_segments"].value)
    exponential = Antenna(
        segment_length=_segment_length(n),
        segment_mass=_segment_mass(n),
        radius=FACTS["collision_radius"].value,
        stiffness=Exponential(base=_v("stiffness_base"), rate=_v("stiffness_rate")).sample(n),
        damping=Exponential(base=_v("damping_base"), rate=_v("damping_rate")).sample(n),
        sensors=_sensors(sensors, n),
        name="exponential",
    )
    return exponential if profile == "exponential" else _control(exponential, profile)


def _v(name: str) -> float:
    return float(FACTS[name].value)


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
    if placement == "even":
        return make_even_sensors(n, int(_v("n_sensors")))
    if placement == "distal":
        return np.arange(n - 111, n + 1, 2)
    if placement == "all":
        return np.arange(1, n + 1)
    raise InvalidInput(f"unknown sensor placement {placement!r}; valid: {', '.join(SENSOR_PLACEMENTS)}.")


def _control(exponential: Antenna, profile: str) -> Antenna:
    n = exponential.n_segments
    if profile == "matched":
        stiffness = Constant(value=n / np.sum(1 / exponential.stiffness)).sample(n)
        return _match_damping(exponential.replace(stiffness=stiffness, name=profile), exponential)
    shape = Constant(value=1.0) if profile == "constant" else Linear(base=1.0, tip=_v("linear_tip_share"))
    return _match_first_mode(exponential.replace(stiffness=shape.sample(n), name=profile), exponential)


def _match_first_mode(control: Antenna, reference: Antenna) -> Antenna:
    """Provisional: scale stiffness to the reference's first undamped frequency, then damping to its damping ratio."""
    ratio = compute_modes(reference, 1).frequency[0] / compute_modes(control, 1).frequency[0]
    return _match_damping(control.replace(stiffness=control.stiffness * ratio**2), reference)


def _match_damping(control: Antenna, reference: Antenna) -> Antenna:
    """Damping proportional to stiffness, at the reference's modal damping ratio of the first mode."""
    trial = control.replace(damping=control.stiffness)
    share = compute_modes(reference, 1).damping_ratio[0] / compute_modes(trial, 1).damping_ratio[0]
    return trial.replace(damping=trial.damping * share)
