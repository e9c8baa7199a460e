"""Antennas of animals, every number with its source; and random variants of an antenna."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal, overload

import numpy as np

from feeler.antenna.files import PAPER, AntennaFile, Fact, Source, parse_antenna
from feeler.antenna.profiles import Constant, Exponential, Linear, Sigmoid
from feeler.antenna.segments import (
    Antenna,
    Follicle,
    compute_modes,
    make_even_sensors,
    to_vector,
)
from feeler.draw import Drawn, LogRange, Spread, describe_spread, draw_shares, spread_out
from feeler.errors import InvalidInput
from feeler.renamed import rename_antenna
from feeler.validation import Count, Seed, checked

# Fit the sigmoid of segment lengths to measured antennae.

_MIN_SEGMENTS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class SigmoidFit:
    """A sigmoid of length shares, and the data it was fitted to.

    Attributes
    ----------
    x : np.ndarray
        Relative segment numbers (segment,), (n − 0.5) / N.
    share : np.ndarray
        Length shares (antenna, segment) of an antenna of N segments; an antenna with another count
        is interpolated.
    squared_residual : float
        Squared norm of the residual of the antennae's mean, Σ (mean − sigmoid)².
    """

    sigmoid: Sigmoid
    x: np.ndarray
    share: np.ndarray
    squared_residual: float


def fit_sigmoid(lengths: Sequence[np.ndarray], n_segments: int | None = None) -> SigmoidFit:
    """Least-squares sigmoid through the segment lengths of several antennae (Supplementary Methods;
    Fig. S1).

    Parameters
    ----------
    lengths
        Segment lengths (segment,) of each antenna, base to tip, any unit; counts may differ.
    n_segments
        Count N that shares refer to; default: the largest count.

    Raises
    ------
    InvalidInput
        No antenna, fewer than 8 segments, or lengths that are not finite and > 0.
    """
    from scipy.optimize import least_squares

    arrays = [
        _check(np.asarray(values, dtype=float), number)
        for number, values in enumerate(lengths, 1)
    ]
    if not arrays:
        raise InvalidInput("give the segment lengths of at least one antenna.")
    n = max(a.size for a in arrays) if n_segments is None else n_segments
    x = (np.arange(n) + 0.5) / n
    share = np.stack([_rescale(values, x) for values in arrays])
    mean = share.mean(axis=0)
    rise = max(mean[-1] - mean[0], 1e-3 / n)
    start = np.array([max(mean[0], 1e-6), rise, 10.0, 0.5])
    scale = np.array([1 / n, 1 / n, 10.0, 0.5])

    def residual(p: np.ndarray) -> np.ndarray:
        return (_make_fit(p * scale).at(x) - mean) * n

    best = least_squares(residual, start / scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    sigmoid = _make_fit(best.x * scale)
    return SigmoidFit(
        sigmoid=sigmoid,
        x=x,
        share=share,
        squared_residual=float(np.sum((mean - sigmoid.at(x)) ** 2)),
    )


def _make_fit(p: np.ndarray) -> Sigmoid:
    low, rise, slope, centre = map(float, p)
    return Sigmoid(low=low, rise=rise, slope=slope, centre=centre)


def _check(values: np.ndarray, number: int) -> np.ndarray:
    if values.ndim != 1 or values.size < _MIN_SEGMENTS:
        raise InvalidInput(
            f"antenna {number} needs a row of at least {_MIN_SEGMENTS} lengths, got shape"
            f" {values.shape}."
        )
    if not (np.isfinite(values).all() and np.all(values > 0)):
        raise InvalidInput(
            f"antenna {number} has segment lengths that are not finite and > 0. Leave the antenna"
            " out."
        )
    return values


def _rescale(values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Shares at relative numbers ``x`` that add to one, for an antenna of ``x.size`` segments."""
    own = (np.arange(values.size) + 0.5) / values.size
    share = np.interp(x, own, values)
    return share / share.sum()


# The flagellum of Periplaneta americana: every number with its source.

_LINEAR = (
    "fitted to the reconstructed targets, no hinge softer than the exponential tip: error 1.60"
    " (18.4 Hz, ζ 0.55; deflection ratios 0.56 and 0.77 instead of 0.22 and 0.55)"
)
_UNIFORM = (
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
    "uniform_stiffness": Fact(value=0.395, unit="N·mm/rad", tag="D+C", note=_UNIFORM),
    "uniform_damping": Fact(value=3.17, unit="N·mm·ms/rad", tag="D+C", note=_UNIFORM),
}

PROFILE_NAMES = ("exponential", "linear", "uniform", "matched")


@checked
def cockroach(profile: str = "exponential", *, sensors: str = "even") -> Antenna:
    """The cockroach antenna, or a control that shares everything but its hinges.

    Parameters
    ----------
    profile
        ``exponential``: the published fit. ``linear``, ``uniform``: their own stiffness and
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
    if (profile := rename_antenna(profile)) not in PROFILE_NAMES:
        raise InvalidInput(f"unknown profile {profile!r}; valid: {', '.join(PROFILE_NAMES)}.")
    return _make_cockroach(profile, sensors)


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
def _make_cockroach(profile: str, sensors: str) -> Antenna:
    n = int(_v("n_segments"))
    # Constant density, radius falling exponentially with arc length [P form, D numbers].
    length = _segment_length(n)
    x = (np.cumsum(length) - length / 2) / length.sum()
    radius = _v("radius_base") * (_v("radius_tip") / _v("radius_base")) ** x
    placements = {
        "even": make_even_sensors(n, int(_v("n_sensors"))),
        "distal": np.arange(n - 111, n + 1, 2),
        "all": np.arange(1, n + 1),
    }
    if sensors not in placements:
        raise InvalidInput(
            f"unknown sensor placement {sensors!r}; valid: {', '.join(placements)}."
        )
    exponential = Antenna(
        segment_length=_segment_length(n),
        segment_mass=(_v("density") * np.pi * radius**2 * length),
        radius=np.full(n, _v("collision_radius")),
        stiffness=Exponential(base=_v("stiffness_base"), rate=_v("stiffness_rate")).sample(n),
        damping=Exponential(base=_v("damping_base"), rate=_v("damping_rate")).sample(n),
        sensors=placements[sensors],
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


def _control(exponential: Antenna, profile: str) -> Antenna:
    n = exponential.n_segments
    if profile == "matched":
        stiffness = Constant(value=n / np.sum(1 / exponential.stiffness)).sample(n)
        return match_damping(
            exponential.replace(stiffness=stiffness, name=profile), exponential
        )

    def sample(quantity: str) -> np.ndarray:
        if profile == "uniform":
            return Constant(value=_v(f"uniform_{quantity}")).sample(n)
        base, tip = (_v(f"linear_{quantity}_{end}") for end in ("base", "tip"))
        return Linear(base=base, tip=tip).sample(n)

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


# The thirty whiskers of a side of the average rat, in space, where they stand on its cheek.
#
# Numbers [B] are those of WHISKiT (Zweifel et al. 2021, doi:10.1073/pnas.2011905118), after
# Belli et al. 2018 (doi:10.1371/journal.pone.0194981): arc length S [mm], the parabola A [1/mm]
# in which a whisker lies, the place of its base [mm] and its angles [rad], in
# ``rat_whiskers.csv``; diameter at the base, slope of the radius, modulus and density.
# WHISKiT's program halves the radius at the tip once more than its equation says; here the
# equation is used. Choices [C] are the radius of the thinnest tips and that all first modes
# have the damping ratio 0.14, the middle of what Hartmann et al. 2003 measured
# (doi:10.1523/JNEUROSCI.23-16-06510.2003) of whiskers whose base was held fast.
#
# Bases are clamped, as WHISKiT clamps them: it gives the first link springs of 1.25 and locks
# them. ``FOLLICLE`` is a choice [C]; a follicle's stiffness was not found published in numbers.
# Tissue of some 10 kPa holds some 3 mm of shaft, equally in all directions, and springs back
# within 1 ms.

_MODULUS = 5000.0  # MPa [B]
_DENSITY = "1.26e-3 + 0.43e-3 * x"  # g/mm³ [B]
_THINNEST = 0.0015  # mm, radius of a tip [C]
_DAMPING_RATIO = 0.14  # [B+C]
FOLLICLE = Follicle(stiffness=(0.03, 0.03, 0.03), damping=(0.03, 0.03, 0.03))  # [C]


@checked
def rat_whiskers(
    side: Literal["left", "right"] = "right",
    *,
    n_segments: Count = 20,
    follicle: Follicle | None = None,
) -> dict[str, tuple[Antenna, np.ndarray]]:
    """The whiskers of one side by name, row by row from A0 to E6; column 0 is the hindmost: each an
    antenna, upright along y and bent towards x at rest, and the pose of its base on the head (6,),
    x, y, z [mm] and a rotation vector [rad] as :class:`feeler.BaseMotion` takes it. The head looks
    along y, x is its right and z up; the origin lies amid the bases.

    ``follicle`` holds each of them, such as :data:`feeler.antenna.animals.FOLLICLE`, which is a
    choice; by default their bases are clamped.
    """
    made = {row["name"]: _make(row, side == "left", n_segments) for row in _read_rows()}
    if follicle is None:
        return made
    return {
        name: (antenna.replace(follicle=follicle), pose)
        for name, (antenna, pose) in made.items()
    }


@cache
def _read_rows() -> tuple[dict, ...]:
    text = files("feeler.antenna").joinpath("rat_whiskers.csv").read_text(encoding="utf-8")
    head, *lines = text.splitlines()
    rows = [
        dict(zip(head.split(","), map(float, line.split(",")), strict=True)) for line in lines
    ]
    names = [f"{'ABCDE'[int(row['row']) - 1]}{row['column']:.0f}" for row in rows]
    return tuple(row | {"name": name} for row, name in zip(rows, names, strict=True))


def _make(row: dict, left: bool, n_segments: int) -> tuple[Antenna, np.ndarray]:
    length, k, column = row["length"], row["row"], row["column"]
    base = 0.5 * (0.041 + 0.002 * length + 0.011 * k - 0.0039 * column)
    slope = 0.0012 + 0.00017 * k - 0.000066 * column + 0.00011 * column**2
    tip = max(base - slope * length, _THINNEST)
    rest = np.zeros((2, n_segments))
    rest[0] = _bend(row["arc"], length, n_segments) * (-1 if left else 1)
    antenna = Antenna.from_beam(
        length=length,
        radius=lambda x: base + (tip - base) * x,
        modulus=_MODULUS,
        density=_DENSITY,
        n_segments=n_segments,
        damping_time=1.0,
        planes=2,
        rest_angle=rest,
        sensors=[1],
        name=f"rat {row['name']}",
    )
    share = _DAMPING_RATIO / compute_modes(antenna, 1).damping_ratio[0]
    return antenna.replace(damping=antenna.damping * share), _stand(row, left)


def _bend(arc: float, length: float, n: int) -> np.ndarray:
    """Angles (hinge,) [rad] of a chain whose segments are equal chords of the parabola A x²."""
    x = np.linspace(0.0, length, 2001)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), arc * np.diff(x**2)))])
    at = np.interp(length * np.arange(n + 1) / n, s, x)
    heading = np.arctan2(arc * np.diff(at**2), np.diff(at))
    return np.diff(heading, prepend=0.0)


def _stand(row: dict, left: bool) -> np.ndarray:
    """The pose of the base: about z, then y, then the whisker's own axis; left is the mirror."""
    theta, phi, zeta = row["theta"] - np.pi / 2, -row["phi"], row["zeta"] + np.pi / 2
    (c, s), (d, t), (e, u) = ((np.cos(a), np.sin(a)) for a in (theta, phi, zeta))
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_y = np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]])
    about_x = np.array([[1, 0, 0], [0, e, -u], [0, u, e]])
    along, across, up = (about_z @ about_y @ about_x).T
    frame = np.stack([-across, along, up], axis=1)  # its axes x, y, z on the head
    place = np.array([row["x"], row["y"], row["z"]])
    if left:  # mirrored; its own x is turned over, too, so that the frame stays right-handed
        image = np.array([-1.0, 1.0, 1.0])
        frame, place = image[:, None] * frame * image, image * place
    return np.concatenate([place, to_vector(frame)])


# Antennas of other animals and robots: one file each in ``species``, with the source of every
# number.
#
# It stands beside them: a result depends on the data files beside the module that names them.

_FILES = files("feeler.antenna") / "species"
SPECIES = tuple(sorted(file.name.removesuffix(".toml") for file in _FILES.iterdir()))


def read_species(name: str) -> AntennaFile:
    """The antenna and the sources of its quantities."""
    file = f"{name}.toml"
    return parse_antenna((_FILES / file).read_text(encoding="utf-8"), file)


@checked
class SampledAntennas(Sequence[Antenna]):
    """Variants of one antenna, each made when it is asked for; ``touch`` gives trial k number k
    modulo their number.

    Attributes
    ----------
    antenna
        What they are variants of.
    columns
        By name, what each is multiplied by: ``stiffness``, ``damping``, ``mass``; and ``gradient``,
        which is added to the logarithm of the stiffness along the antenna, −½ of it at the base and
        ½ at the tip. They become the coordinates ``antenna_stiffness`` … of the touches.
    recipe
        Plain data that make the same again.
    """

    def __init__(
        self, antenna: Antenna, columns: dict[str, np.ndarray], recipe: dict[str, Any]
    ) -> None:
        self.antenna, self.columns, self.recipe = antenna, columns, recipe

    def __len__(self) -> int:
        return len(self.columns["stiffness"])

    @overload
    def __getitem__(self, index: int) -> Antenna: ...
    @overload
    def __getitem__(self, index: slice) -> list[Antenna]: ...
    def __getitem__(self, index: int | slice) -> Antenna | list[Antenna]:
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        k = range(len(self))[index]
        stiffness, damping, mass, gradient = (
            float(self.columns[name][k])
            for name in ("stiffness", "damping", "mass", "gradient")
        )
        n = self.antenna.n_segments
        tilt = np.exp(gradient * ((np.arange(n) + 0.5) / n - 0.5))
        return self.antenna.replace(
            stiffness=self.antenna.stiffness * stiffness * tilt,
            damping=self.antenna.damping * damping,
            segment_mass=self.antenna.segment_mass * mass,
            name=f"{self.antenna.name} {k}",
        )

    def __repr__(self) -> str:
        return f"{len(self)} variants of {self.antenna!r}"


@checked
def sample_antennas(
    n: Drawn,
    antenna: Antenna | None = None,
    *,
    stiffness: Spread = LogRange(0.8, 1.25),
    damping: Spread = LogRange(0.8, 1.25),
    mass: Spread = LogRange(0.9, 1.1),
    gradient: Spread = (-0.5, 0.5),
    seed: Seed = 0,
) -> SampledAntennas:
    """Random variants of an antenna: as stiff, damped and heavy as ranges or distributions say;
    geometry stays.

    The k-th is the same however many are drawn. All defaults are choices [C].

    Parameters
    ----------
    antenna
        Default: the cockroach's.
    stiffness, damping, mass
        Factors, > 0: a number, a range (low, high), a list of choices, a ``LogRange`` or a frozen
        distribution of scipy.stats.
    gradient
        Added to the logarithm of the stiffness along the antenna: at the tip it is exp(gradient)
        times as stiff, relative to the base, as it was.

    Raises
    ------
    InvalidInput
        A range that leaves what an antenna may have.
    """
    antenna = antenna or cockroach()
    spreads = {"stiffness": stiffness, "damping": damping, "mass": mass, "gradient": gradient}
    columns = {
        name: spread_out(s, name, draw_shares(seed, f"antenna {name}", n))
        for name, s in spreads.items()
    }
    for name in ("stiffness", "damping", "mass"):
        if columns[name].min() <= 0:
            raise InvalidInput(
                f"{name} is a factor > 0, got {columns[name].min():.3g} from {spreads[name]!r}."
            )
    recipe = {name: describe_spread(spread) for name, spread in spreads.items()}
    return SampledAntennas(antenna, columns, {**recipe, "n": int(n), "seed": int(seed)})
