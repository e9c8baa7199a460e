"""From stored tensors to what is analysed: units, scaling, posture, and a Dataset's accessor."""

import json
import math
import re
import warnings
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.validation import checked, show

# Units travel with numbers: whoever takes a quantity out of a Dataset says in which unit.

_NEWTON, _JOULE = (1, 1, -2, 0), (1, 2, -2, 0)
_BASE: dict[str, tuple[tuple[int, ...], Any]] = {
    "1": ((0, 0, 0, 0), 1),
    "g": ((1, 0, 0, 0), Fraction(1, 1000)),
    "m": ((0, 1, 0, 0), 1),
    "s": ((0, 0, 1, 0), 1),
    "Hz": ((0, 0, -1, 0), 1),
    "rad": ((0, 0, 0, 1), 1),
    "deg": ((0, 0, 0, 1), Fraction(math.pi / 180)),
    "N": (_NEWTON, 1),
    "J": (_JOULE, 1),
}
"""Powers of kg, m, s and rad, and how many of that unit one is."""

_PREFIX = {"M": 6, "k": 3, "": 0, "c": -2, "m": -3, "u": -6, "n": -9}
_SPELLING = {"µ": "u", "μ": "u", "·": "*", "²": "^2", "³": "^3", "°": "deg", "**": "^"}


@checked
def in_unit(array: xr.DataArray, unit: str) -> xr.DataArray:
    """The quantity in the unit that is asked for, whatever unit it is kept in.

    Parameters
    ----------
    array
        A quantity whose ``attrs["units"]`` says its unit.
    unit
        Products and quotients of g, m, s, Hz, rad, deg, N, J and 1 with the usual prefixes, such
        as ``"uJ"`` (or ``"µJ"``), ``"mm/ms"``, ``"N*mm"`` or ``"1/mm^2"``.

    Returns
    -------
    xarray.DataArray
        The same array where it is in that unit already; else a converted one whose ``units`` is
        ``unit``.

    Raises
    ------
    InvalidInput
        The array says no unit, one that is not known, or one of another kind.
    """
    name, kept = array.name or "array", array.attrs.get("units")
    if kept is None:
        raise InvalidInput(
            f"{name!r} says no unit; set attrs['units'] to convert it to {unit}."
        )
    if kept == unit:
        return array
    kind, size = _read_unit(str(kept))
    wanted, step = _read_unit(unit)
    if kind != wanted:
        raise InvalidInput(f"{name!r} is in {kept}, which cannot be converted to {unit}.")
    factor = Fraction(size) / Fraction(step)
    # 1/1000 is no float: dividing by 1000 rounds once
    values = array * float(factor) if factor >= 1 else array / float(1 / factor)
    return values.assign_attrs({**array.attrs, "units": unit})


def _read_unit(text: str) -> tuple[tuple[int, ...], Fraction]:
    """Powers of the base units, and how many of them one is."""
    plain = "*" + text
    for spelling, letters in _SPELLING.items():
        plain = plain.replace(spelling, letters)
    factor = r"([*/])([A-Za-z]+|1)(?:\^([1-9]))?"
    if not re.fullmatch(f"(?:{factor})+", plain):
        raise InvalidInput(f"{text!r} is no unit; write products and quotients, such as mm/ms.")
    powers, size = np.zeros(4, int), Fraction(1)
    for operator, symbol, power in re.findall(factor, plain):
        own, one = _read_symbol(symbol)
        times = int(power or 1) * (-1 if operator == "/" else 1)
        powers, size = powers + times * np.array(own), size * one**times
    return tuple(powers.tolist()), size


def _read_symbol(symbol: str) -> tuple[tuple[int, ...], Fraction]:
    if symbol in _BASE:
        return _BASE[symbol][0], Fraction(_BASE[symbol][1])
    prefix, base = symbol[:1], symbol[1:]
    if prefix not in _PREFIX or base not in _BASE or base in ("1", "deg"):
        raise InvalidInput(
            f"unknown unit {symbol!r}; known are {', '.join(_BASE)} with the prefixes"
            f" {', '.join(filter(None, _PREFIX))}."
        )
    powers, size = _BASE[base]
    return powers, size * Fraction(f"1e{_PREFIX[prefix]}")


def require_variables(dataset: xr.Dataset, *names: str) -> None:
    """Raise where a Dataset lacks one of these variables."""
    if missing := [name for name in names if name not in dataset.variables]:
        there = ", ".join(map(str, dataset.variables)) or "none"
        raise InvalidInput(f"the Dataset has no variable {missing[0]!r}; it has: {there}.")


# The side that a touch comes from: its sign in the tensors, and peaks that do not depend on it.

_SIDES = {"left", "right", "", "nan"}


@checked
def mirror_to_left(tensors: xr.DataArray) -> xr.DataArray:
    """The tensors as if every object had come from the left: bending away from the object is
    positive, towards it negative.

    Trials whose coordinate ``side`` is "right" are mirrored and then labelled "left"; all others,
    and all trials of tensors without that label, stay as they are. In the plane a mirrored angle
    is −θ. In space the mirror stands across the direction a = (cos φ, sin φ) of the trial's
    ``azimuth`` φ: b − 2 (b · a) a for bending b in both planes, and torsion changes its sign, for
    angles that are small at each hinge.

    Parameters
    ----------
    tensors
        Bending: ``angle``, ``curvature`` or ``velocity`` of a Dataset, (trial, sensor, time) or in
        space (trial, plane, sensor, time).

    Returns
    -------
    xarray.DataArray
        Same dims, unit and coordinates, ``side`` aside.
    """
    right = find_right(tensors)
    if right is None or not right.any():
        return tensors
    found = tensors.where(~right, _mirror(tensors)).transpose(*tensors.dims)
    return found.assign_coords(side=tensors["side"].where(~right, "left"))


def find_right(tensors: xr.DataArray | xr.Dataset) -> xr.DataArray | None:
    """Whether each trial's object came from the right; None where no trial says its side."""
    side = tensors.coords.get("side")
    if side is None or not {*side.dims} <= {"trial"}:
        return None
    if unknown := sorted({*map(str, np.unique(side.astype(str)))} - _SIDES):
        raise InvalidInput(
            f"side is 'left', 'right', or empty where unknown; got {unknown[0]!r}."
        )
    return side.drop_vars([name for name in side.coords if name != "trial"]) == "right"


def _mirror(tensors: xr.DataArray) -> xr.DataArray:
    if "plane" not in tensors.dims:
        return -tensors
    azimuth = tensors.coords.get("azimuth", xr.DataArray(0.0)).drop_vars(
        "azimuth", errors="ignore"
    )
    from scipy.special import cosdg, sindg  # slow to load

    planes = [tensors.isel(plane=[k]) for k in range(tensors.sizes["plane"])]
    x, z = (plane.drop_vars("plane", errors="ignore") for plane in planes[:2])
    away = (cosdg(azimuth), sindg(azimuth))
    along = x * away[0] + z * away[1]
    mirrored = [
        (plane - 2 * along.assign_coords(plane.coords) * share).astype(tensors.dtype)
        for plane, share in zip(planes, away, strict=False)
    ]
    return xr.concat([*mirrored, *(-plane for plane in planes[2:])], "plane")


@checked
def get_bending(tensors: xr.DataArray) -> xr.DataArray:
    """Bending away from the object (trial, sensor, time), as :func:`mirror_to_left` has it; in
    space the length of its vector in both planes, √(b_x² + b_z²), without torsion.
    """
    if "plane" in tensors.dims:
        return (tensors.isel(plane=slice(2)) ** 2).sum("plane") ** 0.5
    return mirror_to_left(tensors)


@checked
def measure_peak(*tensors: xr.DataArray | np.ndarray) -> float:
    """The greatest magnitude in all of the tensors, in their unit, whatever its sign; in space that
    of the vector in both planes (:func:`get_bending`). NaN entries do not count.

    Raises
    ------
    InvalidInput
        No tensors.
    """
    if not tensors:
        raise InvalidInput("measure_peak needs at least one tensor.")
    plain = (get_bending(one) if isinstance(one, xr.DataArray) else one for one in tensors)
    sizes = (np.abs(np.asarray(one)) for one in plain)
    return max(float(np.fmax.reduce(size, axis=None, initial=0.0)) for size in sizes)


# What the entries of tensors stand for: their dims, and whether others have the same sensors,
# clock and unit.

_DIMS = ("trial", "sensor", "time")


def find_dims(X: Any) -> tuple[str, str, str]:
    """What the dims of tensors are called that stand for trial, sensor and time.

    ``trial``, ``sensor`` and ``time`` are what they say, wherever they stand; dims of other names,
    such as (epoch, neuron, time), take the places that are left, in their order.
    """
    named = isinstance(X, xr.DataArray | xr.Variable)  # an array of HDF5 has other dims
    dims = [str(dim) for dim in (X.dims if named else _DIMS)]
    if len(dims) != 3:
        hint = ' One recording is X.expand_dims("trial").' if len(dims) == 2 else ""
        raise InvalidInput(
            "The tensors need three dims: trial, sensor and time, or others in this order; got"
            f" {tuple(dims)}.{hint}"
        )
    others = iter([dim for dim in dims if dim not in _DIMS])
    first, second, third = (dim if dim in dims else next(others) for dim in _DIMS)
    return first, second, third


def read_axes(X: Any, *, aligned: bool = False) -> dict[str, Any]:
    """Labels of the sensors, time between samples and unit, as far as the tensors say them; of
    ``aligned`` ones also when they begin, since contact where they say it.
    """
    X = stack_planes(X["angle"] if hasattr(X, "data_vars") else X)
    axes: dict[str, Any] = {}
    if units := getattr(X, "attrs", {}).get("units"):
        axes["units"] = str(units)
    indexes = getattr(X, "indexes", {}) if getattr(X, "ndim", 0) == 3 else {}
    if indexes and (sensor := find_dims(X)[1]) in indexes and indexes[sensor].nlevels == 1:
        axes["sensor"] = indexes[sensor].tolist()
    if "time" in indexes and indexes["time"].dtype.kind in "fiu" and len(indexes["time"]) > 1:
        time = indexes["time"].to_numpy()
        axes["step"] = float(np.median(np.diff(time)))
        lead = np.unique(X.coords.get("lead", 0.0))
        if aligned and lead.size == 1:
            axes["start"] = float(time[0] - np.nan_to_num(lead[0]))
    return axes


def check_axes(X: Any, known: dict[str, Any]) -> None:
    """Refuse another unit and other sensors, or in another order, than were learned; warn of other
    names, of another time between samples, and of another begin.
    """
    axes = read_axes(X, aligned="start" in known)
    other = {key for key in axes.keys() & known.keys() if axes[key] != known[key]}
    if "units" in other:
        raise InvalidInput(
            f"What was fitted learned tensors in {known['units']}, these are in {axes['units']}."
            f" Take them in one unit: feeler.tensors.in_unit(X, {known['units']!r})."
        )
    if "sensor" in other:
        if {*axes["sensor"]} & {*known["sensor"]}:
            raise InvalidInput(
                "The tensors have other sensors than those that were learned, or the same in"
                " another order. Take the same, from base to tip: X.sel(sensor=…)."
            )
        warnings.warn(
            "The sensors have other names than those that were learned; they are taken in their"
            " order.",
            stacklevel=4,
        )
    for key, words in (("step", "time between samples"), ("start", "time of the first sample")):
        if key in other and not np.isclose(axes[key], known[key], rtol=0.01, atol=1e-6):
            warnings.warn(
                f"The tensors have another {words} than those that were learned ({axes[key]:g},"
                f" learned {known[key]:g}), so that samples are taken for those of other moments."
                " Resample: X.interp(time=…).",
                stacklevel=4,
            )


# On the way to an encoder: non-negative, scaled tensors, never baked into what is stored; and
# the labels of what comes back.

SQUARED = (1e-140, 1e140)
"""Magnitudes whose squares, and sums of them, are numbers."""
Tensors = TypeVar("Tensors", xr.DataArray, np.ndarray)
MUCH = 0.25
"""Share of a trial's sum of squares that is not left out where bending both ways can be kept [C];
of the insect's touches from the left that were tried, at most 0.1 is negative."""
_MOST = 0.4  # [C] as MUCH, that is not left out without a word; a robot that rings reaches 0.37


@checked
def stack_planes(tensors: Tensors) -> Tensors:
    """Tensors (trial, sensor, time) of those in space (trial, plane, sensor, time): the sensors of
    one plane after those of the other. Without planes only the dims are put in this order, where
    they have names.
    """
    own: Any = tensors
    dims: tuple[str, ...] = getattr(tensors, "dims", ())
    if {"trial", "time"} <= {*dims}:
        own = own.transpose("trial", ..., "time")
    if "plane" not in dims:
        return own
    stacked = own.stack(line=("plane", "sensor"), create_index=False)
    return (
        stacked.drop_vars("sensor", errors="ignore")
        .rename(line="sensor")
        .transpose("trial", "sensor", "time")
    )


def refuse_masked(values: Any) -> None:
    """Refuse a NumPy array of which entries are masked: as plain numbers they would count."""
    if np.ma.is_masked(values):
        count = int(np.ma.count_masked(values))
        raise InvalidInput(
            f"{count} of {np.size(values)} entries are masked, and would be taken as measured."
            " Leave such trials out, or fill the gaps: np.ma.filled(X, value)."
        )


def find_scale(values: np.ndarray) -> float:
    """The power of two below the greatest magnitude, by which division rounds nothing; 1 where all
    is 0.
    """
    high = np.abs(values).max(initial=0.0)
    return float(2.0 ** (np.frexp(high)[1] - 1)) if high > 0 else 1.0


def check_squares(values: np.ndarray, name: str = "tensors") -> None:
    """Refuse what is too small or too large for its squares to be numbers."""
    high = np.abs(values).max(initial=0.0)
    if high > 0 and not SQUARED[0] <= high <= SQUARED[1]:
        raise InvalidInput(
            f"The greatest magnitude of the {name} is {high:.3g}; it must lie between"
            f" {SQUARED[0]:g} and {SQUARED[1]:g}, where squares are numbers. Choose another unit,"
            " or scale them: feeler.tensors.scale_common(X)."
        )


@checked
def rectify(tensors: Tensors) -> Tensors:
    """The tensors with negative values set to 0, as in the published video [D].

    Bending away from an object is positive after :func:`feeler.tensors.mirror_to_left`. Where more
    than 40 % of a trial's sum of squares is set to 0, a ``ModelValidityWarning`` warning
    says how much.
    """
    share = measure_negative(tensors)
    lost = share > _MOST
    if lost.any():
        text = (
            "rectify sets much of a trial's signal to 0. Objects from the right bend the antenna to"
            " the negative side: use mirror_to_left first, or fold_signs, which keeps bending both"
            " ways."
        )
        details = (
            f"Up to {share.max():.0%} of a trial's sum of squares, and in {lost.sum()} of"
            f" {lost.size} trials more than {_MOST:.0%}."
        )
        warnings.warn(ModelValidityWarning(text, details), stacklevel=3)
    return tensors.clip(min=0)


def measure_negative(tensors: xr.DataArray | np.ndarray) -> np.ndarray:
    """The share of each trial's sum of squares that is negative, Σ min(x, 0)² / Σ x² (trial,); 0
    for a trial that is 0 everywhere. What has no trials counts as one.
    """
    if getattr(getattr(tensors, "dtype", None), "kind", "") not in tuple("biuf"):
        raise InvalidInput(f"tensors must be an array of numbers, got {show(tensors)}.")
    named: Any = tensors if isinstance(tensors, xr.DataArray) else xr.DataArray(tensors)
    alone = named.ndim < 3 if isinstance(tensors, np.ndarray) else "trial" not in named.dims
    values = named.transpose("trial", ..., missing_dims="ignore").values
    return np.array([_measure_negative(one) for one in (values[None] if alone else values)])


def _measure_negative(values: np.ndarray) -> float:
    known = values[np.isfinite(values)].astype(float)
    known /= np.abs(known).max(initial=0.0) or 1.0  # no square over- or underflows
    return float(np.sum(known[known < 0] ** 2) / (np.sum(known**2) or 1.0))


@checked
def fold_signs(tensors: Tensors) -> Tensors:
    """Non-negative tensors (trial, sensor, time) that keep bending both ways: max(x, 0) of every
    sensor, then max(−x, 0) of every sensor as further sensors; those in space as
    :func:`stack_planes` has them.

    For what needs values ≥ 0, such as ``ConvolutiveNMF``, where an antenna is touched on both
    sides.
    """
    if len(getattr(tensors, "shape", ())) < 2:
        raise InvalidInput(
            f"fold_signs: tensors must be an array (trial, sensor, time), got {tensors!r:.60}."
        )
    folded: Any = stack_planes(tensors)
    ways = [folded.clip(min=0), (-folded).clip(min=0)]
    if not isinstance(folded, xr.DataArray):
        found: Any = np.concatenate(ways, axis=-2)
    else:
        found = xr.concat(ways, "sensor", coords="minimal", compat="override")
    return found


@checked
def scale_common(tensors: xr.DataArray | np.ndarray) -> xr.DataArray | np.ndarray:
    """The set divided by its greatest magnitude: one factor for all tensors, so that they stay
    comparable.

    Non-negative input comes out in [0, 1], as SSIM with range 1 needs it. To compare sets (speeds,
    antennas), scale them together, then split them.
    """
    tensors = tensors if isinstance(tensors, xr.DataArray) else np.asarray(tensors)
    largest = float(np.max(np.abs(np.asarray(tensors)), initial=0.0))
    if not (np.isfinite(largest) and largest > 0):
        raise InvalidInput(
            f"cannot scale tensors whose greatest magnitude is {largest}; did any contact take"
            " place?"
        )
    return tensors / largest


def label_like(
    values: np.ndarray, given: Any, dims: tuple[str, ...], name: str, **attrs: object
) -> Any:
    """``values`` with these dims and the coordinates of ``given`` along them; plain where ``given``
    is plain.
    """
    if not isinstance(given, xr.DataArray):
        return values
    sizes = dict(zip(dims, values.shape, strict=True))
    coords = {
        key: item
        for key, item in given.coords.items()
        if item.dims and all(sizes.get(str(dim)) == given.sizes[dim] for dim in item.dims)
    }
    return xr.DataArray(values, dims=dims, coords=coords, name=name, attrs=attrs)


@checked
def project_planes(
    tensors: xr.DataArray, around: float | Sequence[float] = 0.0, turn: float = 0.0
) -> xr.DataArray:
    """Bending towards sides of the antenna: b_x cos φ + b_z sin φ (trial, side, sensor, time).

    Parameters
    ----------
    tensors
        Angles or curvature, in space (trial, plane, sensor, time); those of an antenna in one plane
        have b_z = 0. Torsion bends nothing.
    around
        Where the sides lie around the antenna: φ [degrees], 0 towards x and 90 towards z, in the
        frame of each segment.
    turn
        How much farther around each sensor sits than the one before it [degrees].
    """
    sides = np.atleast_1d(np.asarray(around, dtype=float))
    if not np.isfinite([*sides, turn]).all():
        raise InvalidInput(
            f"around and turn must be finite angles [degrees], got {around}, {turn}."
        )
    rank = xr.DataArray(np.arange(tensors.sizes["sensor"]), dims="sensor")
    at = np.deg2rad(xr.DataArray(sides, dims="side") + turn * rank)
    if "plane" in tensors.dims:
        x, z = (tensors.isel(plane=k, drop=True) for k in range(2))
        found = x * np.cos(at) + z * np.sin(at)
    else:
        found = tensors * np.cos(at)
    found = found.assign_coords(around=("side", sides)).assign_attrs(tensors.attrs)
    return found.transpose("trial", "side", "sensor", "time")


# The posture of an antenna from what its sensors recorded.


def reconstruct_posture(tensors: xr.Dataset, antenna: Antenna) -> xr.DataArray:
    """Base, hinges and tip of every recorded moment, from the sensors' angles.

    Between sensors the bending beyond the rest shape, (θ − θ_rest) / ℓ, is interpolated linearly
    along the arc and held beyond the first and the last; where all hinges are sensors nothing is
    interpolated. With the default 56 of 140 hinges, no point of the paper's touches is off by more
    than 0.07 mm (0.16 % of the length) for the exponential profile and 0.02 mm for the uniform
    one; the tip's greatest error in a touch is in the median 0.02 and 0.01 mm.

    Parameters
    ----------
    tensors
        Touches with ``angle`` (trial, sensor, time) [rad] and the sensors' ``segment``.
    antenna
        The antenna that was touched.

    Returns
    -------
    xarray.DataArray
        ``points`` (trial, time, joint, axis) [mm], seen from the base.

    Raises
    ------
    InvalidInput
        Sensors on segments that the antenna does not have.
    """
    hinge = tensors["segment"].values - 1
    if hinge.min() < 0 or hinge.max() >= antenna.n_segments:
        raise InvalidInput(
            f"the sensors sit on segments {hinge.min() + 1} to {hinge.max() + 1}, but"
            f" {antenna.name!r} has {antenna.n_segments}. Give the antenna that was touched."
        )
    angle = in_unit(tensors["angle"], "rad").transpose("trial", "time", ..., "sensor").values
    whole = spread_angles(angle, antenna, hinge)
    return xr.DataArray(
        antenna.shape(whole),
        dims=("trial", "time", "joint", "axis"),
        coords={
            "trial": tensors["trial"],
            "time": tensors["time"],
            "axis": ["x", "y", "z"][: 3 if antenna.spatial else 2],
        },
        name="points",
        attrs={"units": "mm", "long_name": "base, hinges and tip, seen from the base"},
    )


def compute_bend(tensors: xr.Dataset, antenna: Antenna) -> np.ndarray:
    """Curvature away from the object of every segment (time, segment) [1/mm] in a Dataset's first
    touch (:func:`feeler.tensors.mirror_to_left`); in space the length of its vector of both planes.
    """
    angle = in_unit(tensors["angle"], "rad").transpose("trial", "time", ..., "sensor").values[0]
    bend = spread_angles(angle, antenna, tensors["segment"].values - 1) / antenna.segment_length
    if antenna.spatial:
        return np.linalg.norm(bend[:, :2], axis=1)
    right = find_right(tensors)
    return bend if right is None or not np.atleast_1d(right)[0] else -bend


def spread_angles(angle: np.ndarray, antenna: Antenna, hinge: np.ndarray) -> np.ndarray:
    """Angles of all hinges (…, hinge) [rad] from those of some (…, sensor), as
    :func:`reconstruct_posture` says.

    ``hinge`` (sensor,) holds the places of the sensors among the hinges, counted from 0, in any
    order.
    """
    hinge, angle = np.sort(hinge), angle[..., np.argsort(hinge)]
    bending = (angle - antenna.rest_angle[..., hinge]) / antenna.segment_length[hinge]
    known, wanted = antenna.hinge_position[hinge], antenna.hinge_position
    between = np.stack([np.interp(wanted, known, row) for row in np.eye(len(known))])
    return antenna.rest_angle + antenna.segment_length * (bending @ between)


# ``dataset.feeler``: what is most often asked of a Dataset of touches, in one word each.

_VIEWS = "feeler.plotting.results"  # named, not imported: avoids importing matplotlib


@xr.register_dataset_accessor("feeler")
class TouchAccessor:
    """Pictures, movies and postures of a Dataset of touches; ``feeler.touch`` and ``feeler.load``
    bring it along.
    """

    def __init__(self, tensors: xr.Dataset) -> None:
        self._tensors = tensors

    @property
    def antenna(self) -> Antenna:
        """The antenna that the Dataset was made with, from its configuration.

        Raises
        ------
        InvalidInput
            The configuration holds none, as in recordings, or more than one.
        """
        try:
            return Antenna(**json.loads(self._tensors.attrs["configuration"])["antenna"])
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise InvalidInput(
                "this Dataset does not say what one antenna it was made with; hand it in:"
                " ds.feeler.posture(antenna)."
            ) from error

    def posture(self, antenna: Antenna | None = None) -> xr.DataArray:
        """Base, hinges and tip of every moment; see
        :func:`feeler.tensors.transforms.reconstruct_posture`.
        """

        return reconstruct_posture(self._tensors, self.antenna if antenna is None else antenna)

    def plot(self, trial: int = 0, variable: str = "curvature", ax: Any = None) -> Any:
        """One trial as an image, sensors from base to tip against time: a matplotlib Figure, which
        notebooks show (its Axes are ``figure.axes[0]``, or the ``ax`` handed in).
        """
        return resolve_name(f"{_VIEWS}:plot_trial")(self._tensors, trial, variable, ax).figure

    def movie(
        self, path: str | Path, trial: int = 0, antenna: Antenna | None = None, **how: Any
    ) -> Path:
        """One trial's moving antenna beside its growing tensor, as MP4 (extra ``movie``);
        ``slower`` and ``fps`` as elsewhere. The path of the film, which notebooks play.
        """
        antenna = self.antenna if antenna is None else antenna
        return resolve_name(f"{_VIEWS}:write_trial_movie")(
            self._tensors, antenna, Path(path), trial, **how
        )
