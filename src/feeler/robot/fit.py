"""Fit of the robot's factors p1 and p2 to the ringing after a release (Methods)."""

import warnings
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy.signal import find_peaks

from feeler.analysis.response import DampedCosine, check_trace, fit_damped_cosine
from feeler.antenna import Antenna, compute_modes
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.records import Gt, Shown
from feeler.robot.description import INTERVAL, Flexures, compute_tip, make_robot
from feeler.robot.recordings import Recording
from feeler.validation import checked

_MAX_UPDATES = 12
_CLOSE = 1e-5  # relative distance at which the updates stop
_MIN_CYCLES = 2.0
_RINGS = 0.8  # [C] share of the tip's variance that a damped cosine should explain, …
_CLEAR = 0.5  # [C] … and of a hinge's for its sign to be judged
_FAR = 30.0  # [C] p1 beyond this factor is questioned
_REVERSED = 0.1  # [C] by which amplitudes must be liker the mode in reversed order (as cosines)
_MIN_RINGING = 0.02  # rad; sum of hinge angles below which there is nothing to measure


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotFit(Shown):
    """The factors that make the model ring as the recording does.

    Attributes
    ----------
    stiffness_factor : float
        p1 [1].
    damping_factor : float
        p2 [ms].
    error : float
        Root of the sum of the two squared relative errors, as in the paper.
    antenna : Antenna
        The fitted model.
    """

    stiffness_factor: float
    damping_factor: float
    error: float
    target: DampedCosine
    reached: DampedCosine
    n_evaluations: int
    antenna: Antenna


@checked
def _measure_ringing(time: np.ndarray, tip: np.ndarray) -> DampedCosine:
    """Damped frequency and damping ratio of a free tip trace (time,).

    ``y(t) = A exp(−ζω t) cos(2πf t + φ) + b`` with ω = 2πf/√(1 − ζ²), fitted from the first
    crossing of rest on, when the faster modes have died down. The first sample must be the release
    or later.

    Raises
    ------
    InvalidInput
        Not finite, not evenly sampled, less than two cycles, or nothing that rings (over-damped, or
        no deflection).
    """
    time, tip = check_trace(time, tip, "a ringing trace")
    rest = np.mean(tip[-max(tip.size // 4, 2) :])
    crossings = np.flatnonzero(np.diff(np.signbit(tip - rest)))
    if crossings.size < 2 * _MIN_CYCLES:
        raise InvalidInput(
            f"the trace crosses rest {crossings.size} times; at least {2 * _MIN_CYCLES:.0f} (two"
            " cycles) are needed. It is too short, over-damped (which has no damped frequency), or"
            " holds no release."
        )
    time, tip = time[crossings[0] :], tip[crossings[0] :]
    # from the spectrum's peak (light damping) and the first extremes' spacing (heavy damping)
    interval, away = time[1] - time[0], tip - np.mean(tip[-max(tip.size // 4, 2) :])
    spectrum = np.abs(np.fft.rfft(away * np.hanning(away.size), 8 * away.size))
    guesses = [(np.argmax(spectrum[4:]) + 4) / (8 * away.size * interval)]
    extremes, _ = find_peaks(np.abs(away), prominence=0.05 * np.abs(away).max())
    if extremes.size >= 2:
        guesses.append(1 / (2 * (extremes[1] - extremes[0]) * interval))
    found = [fit_damped_cosine(time, tip, f, ratio) for f in guesses for ratio in (0.016, 0.16)]
    return min(found, key=lambda fit: fit.residual)


@checked
def simulate_release(
    antenna: Antenna,
    posture: Annotated[np.ndarray, "hinge"],
    duration: Annotated[float, Gt(0)],
    *,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
) -> np.ndarray:
    """Hinge angles (hinge, time) [rad] at 1 kHz after letting go of ``posture`` (hinge,) [rad]."""
    from feeler.physics.run import run_scene
    from feeler.physics.scene import Clock, Scene

    if np.shape(posture) != (antenna.n_segments,):
        raise InvalidInput(
            f"posture needs one angle per hinge: {antenna.n_segments}, got shape"
            f" {np.shape(posture)}."
        )
    clock = Clock(
        duration=duration, sample_interval=INTERVAL, timestep=choose_timestep(timestep, engine)
    )
    return run_scene(
        Scene(antenna=antenna, angle=posture, label="release"), clock, engine
    ).angle.T


@checked
def make_posture(antenna: Antenna, deflection: float = 15.0) -> np.ndarray:
    """Angles (hinge,) [rad] under a sideways force that holds the tip ``deflection`` mm off."""
    arm = antenna.length - antenna.hinge_position
    angle = np.divide(
        arm, antenna.stiffness, out=np.zeros_like(arm), where=antenna.stiffness > 0
    )
    return angle * deflection / float(arm @ angle)


@checked
def fit_factors(
    recording: Recording,
    *,
    hinges: Flexures | None = None,
    theory: Antenna | None = None,
    name: str = "fitted robot",
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
) -> RobotFit:
    """Factors p1 and p2 for which the model rings as a recorded release does.

    The closed form for proportional damping starts it (p1 = (ω/ω_th)², p2 = 2 ζ p1/ω, from the
    first mode); then the simulated release from the recorded posture, measured in the same way, is
    matched to the recording.

    Parameters
    ----------
    recording
        Hinge angles on an even time base, first sample at the release. A hinge that has no sensor,
        or no values, is taken to bend as a force on the tip bends it beside its neighbours.
    hinges
        Geometry of the flexures; default :func:`make_flexures`.
    theory
        In place of ``hinges``, any antenna: p1 and p2 then scale its stiffness (damping = p2 ·
        stiffness), as does :attr:`feeler.robot.RobotFile.theory`.
    engine, timestep
        Of the simulated release, as for :func:`feeler.touch`.

    Raises
    ------
    InvalidInput
        Capacitance instead of angles, the wrong number of hinges, a recording that does not ring,
        or hinges that do not bend as those of the model do: one with the opposite sign, or all in
        reversed order.
    """
    if theory is None:
        theory = make_robot(hinges=hinges, stiffness_factor=1.0, damping_factor=1.0)
    theory = theory.replace(name=name)
    recording = _fill_hinges(recording, theory)
    target = _measure_ringing(
        recording.time, compute_tip(theory, _check_release(recording, theory))
    )
    _check_hinges(recording, theory, target)
    if target.r_squared < _RINGS:
        warning = ModelValidityWarning(
            "a damped cosine explains little of how the tip moves after the release: p1 and p2 may"
            " be those of noise, drift or a second release.",
            f"{target.r_squared:.0%}.",
        )
        warnings.warn(warning, stacklevel=3)
    release = _find_release(recording)
    # Closed form: with k = p1·k_th and c = p2·k_th every mode is damped by ζ = p2 ω/(2 p1), and ω
    # grows with √p1.
    omega = 2 * np.pi * target.frequency / np.sqrt(1 - target.damping_ratio**2)
    p1 = (omega / (2 * np.pi * compute_modes(theory, 1).frequency[0])) ** 2
    if not 1 / _FAR < p1 < _FAR:
        text = "the hinges are far from as stiff as their geometry says: are times and sizes right?"
        warnings.warn(ModelValidityWarning(text, f"p1 = {p1:.3g}."), stacklevel=3)
    factors, best = np.array([p1, 2 * target.damping_ratio * p1 / omega]), None
    for count in range(1, _MAX_UPDATES + 1):
        antenna = theory.replace(
            stiffness=factors[0] * theory.stiffness, damping=factors[1] * theory.stiffness
        )
        motion = simulate_release(antenna, *release, engine=engine, timestep=timestep)
        try:
            clock = np.arange(motion.shape[1]) * INTERVAL
            reached = _measure_ringing(clock, compute_tip(antenna, motion))
        except InvalidInput:
            break
        error = float(
            np.hypot(
                reached.frequency / target.frequency - 1,
                reached.damping_ratio / target.damping_ratio - 1,
            )
        )
        if best is None or error < best.error:
            best = RobotFit(
                stiffness_factor=float(factors[0]),
                damping_factor=float(factors[1]),
                error=error,
                target=target,
                reached=reached,
                n_evaluations=count,
                antenna=antenna,
            )
        if error < _CLOSE:
            break
        # p1 by the squared ratio of the frequencies, and p2 so that ζ is mended
        faster = target.frequency / reached.frequency
        factors = factors * [faster**2, faster * target.damping_ratio / reached.damping_ratio]
    if best is None:
        raise InvalidInput(
            "no factors make the model ring like the recording. Is it a release, is the geometry"
            " right?"
        )
    return replace(best, n_evaluations=count)


@checked
def compare_tips(
    recording: Recording,
    antenna: Antenna,
    *,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
) -> np.ndarray:
    """Tip [mm] (2, time) off rest: as recorded, and of ``antenna`` from the same posture."""
    recording = _fill_hinges(recording, antenna)
    recorded = compute_tip(antenna, _check_release(recording, antenna))
    motion = simulate_release(
        antenna, *_find_release(recording), engine=engine, timestep=timestep
    )
    after = recording.time - recording.time[0]
    model = np.interp(
        after, np.arange(motion.shape[1]) * INTERVAL, compute_tip(antenna, motion)
    )
    return np.array([recorded - recorded[-max(recorded.size // 4, 2) :].mean(), model])


def _find_release(recording: Recording) -> tuple[np.ndarray, float]:
    """Angles off rest that are let go of, and how long the record goes on."""
    rest = recording.values[:, -max(recording.values.shape[1] // 4, 2) :].mean(axis=1)
    return recording.values[:, 0] - rest, float(np.ptp(recording.time)) + INTERVAL


def _fill_hinges(recording: Recording, theory: Antenna) -> Recording:
    """The recording with an angle for every hinge: one without a sensor, or without values, bends
    as a force on the tip bends it beside its neighbours.
    """
    n, known = theory.n_segments, np.isfinite(recording.values).any(axis=1)
    sensed = theory.sensors - 1 if known.size != n else np.arange(n)
    if sensed.size != known.size or not known.any() or (known.all() and known.size == n):
        return recording
    share, places = make_posture(theory), sensed[known]
    join = [np.interp(np.arange(n), places, row) for row in np.eye(places.size)]
    felt = recording.values[known] / share[places, None]
    return recording.replace(
        values=share[:, None] * (np.transpose(join) @ felt), velocity=None, effort=None
    )


def _check_hinges(recording: Recording, theory: Antenna, tip: DampedCosine) -> None:
    """Refuse hinges that ring with the opposite sign, or in reversed order, beside the model's
    first mode; those whose motion is mostly something else are not judged.
    """
    sensed = theory.sensors - 1
    omega = 2 * np.pi * tip.frequency
    decay = omega * tip.damping_ratio / np.sqrt(1 - tip.damping_ratio**2)
    after, values = recording.time - recording.time[0], recording.values[sensed].T
    ring = np.exp((1j * omega - decay) * after)
    basis = np.stack([ring.real, ring.imag, np.ones(after.size)], axis=1)
    found = np.linalg.lstsq(basis, values, rcond=None)[0]
    clear = (values - basis @ found).var(axis=0) < (1 - _CLEAR) * values.var(axis=0)
    mode = compute_modes(theory, 1).angle[0, sensed]
    mode = mode / np.linalg.norm(mode)
    share = (found[0] + 1j * found[1]) * clear * np.sign(mode)
    turned = (share * np.conj(share @ np.abs(mode))).real < 0
    if turned.any():
        raise InvalidInput(
            f"hinge {', '.join(map(str, sensed[turned] + 1))} bends against the others: is the sign"
            " of its angles wrong? Correct it in the recording, or in the sensors' calibration."
        )
    size = np.abs(share)
    if np.dot(size[::-1] - size, np.abs(mode)) > _REVERSED * np.linalg.norm(size):
        raise InvalidInput(
            "the hinges bend as the model's do in reversed order: are the channels written from tip"
            " to base? They go from base to tip."
        )


def _check_release(recording: Recording, theory: Antenna) -> np.ndarray:
    if recording.quantity != "angle":
        raise InvalidInput(
            "the fit needs hinge angles; turn capacitance into angles with a sensor calibration"
            " first."
        )
    if recording.n_sensors != theory.n_segments:
        n = theory.n_segments
        raise InvalidInput(
            f"the recording has {recording.n_sensors} channels, the model {n} hinges, of which"
            f" {theory.sensors.size} have a sensor."
        )
    if np.abs(recording.values.sum(axis=0)).max() < _MIN_RINGING:
        raise InvalidInput(
            "the recording holds no deflection worth measuring: it must start at the release."
        )
    return recording.values
