"""What was measured on an animal: films of releases, and tables with units in their headers,
segments under the microscope and force against deflection.
"""

import warnings
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline
from sklearn.isotonic import isotonic_regression

from feeler.antenna.files import BEAM_UNITS
from feeler.antenna.segments import Antenna
from feeler.calibration.problem import Protocol
from feeler.calibration.traces import (
    MAX_GAP,
    Traces,
    bridge,
    cut_at_release,
    find_rest,
    load_traces,
    read_place,
)
from feeler.errors import FeelerError, InvalidInput, ModelValidityWarning, suggest
from feeler.experiments.mechanics import hold
from feeler.files import read_start
from feeler.physics.equilibrium import compute_point, solve_static
from feeler.records import Ge, Gt, Len, Record, Shown, Unit
from feeler.tables import find_times, read_table, sniff_columns, split_unit
from feeler.tensors.formats import PLAIN_TABLES, START, Format
from feeler.tracking import Tracks, load_tracks
from feeler.tracking.quality import find_usual
from feeler.validation import checked

# Columns by name and unit: length_um, force (mN), diameter [µm].

_LENGTHS = {**BEAM_UNITS["length"], "nm": 1e-6}
_DEFLECTION, _FORCE = ("deflection", "displacement", "extension"), ("force", "load")
_OWNERS = ("animal", "individual", "specimen", "subject", "id")
_SUMS = ("sum", "total", "mean", "average", "median", "sd", "se", "sem", "std")  # of other rows
_FORCES = {"N": 1.0, "mN": 1e-3, "µN": 1e-6, "nN": 1e-9, "g": 9.80665e-3, "mg": 9.80665e-6}


# Segments under the microscope.


@checked
def load_microscope(
    path: str | Path,
    *,
    modulus: Annotated[float, Gt(0), Unit("MPa")],
    density: Annotated[float, Gt(0), Unit("g/mm³")] = 1.1e-3,
    damping_time: Annotated[float, Ge(0), Unit("ms")] = 1.0,
    n_segments: int | None = None,
    **fields: Any,
) -> Antenna:
    """An antenna from a table of what was measured along it, base to tip, as
    :meth:`feeler.Antenna.from_beam` makes it.

    The table has a column ``diameter`` or ``radius``, and ``length`` of each segment; or, for an
    antenna that was measured at some places only, ``position``, the distance from the base. Each
    header says its unit, as in ``length_um`` or ``diameter (µm)``. A column ``segment`` gives the
    order. Between the middles of segments, or the places, the diameter is linear.

    Parameters
    ----------
    modulus, density, damping_time
        As for a beam; guesses are corrected by :func:`feeler.calibration.fit_measurements`.
    n_segments
        Of an antenna that is given by places; default 60.
    fields
        Others of ``from_beam``: planes, sensors, name.

    Raises
    ------
    InvalidInput
        A column without a unit, none of a length, or numbers that are not > 0.
    """
    table = read_table(path, words=True)
    order = np.arange(len(table.values))
    named = next((name for name in table.columns if name.lower() in ("segment", "number")), "")
    if named and named not in table.words:
        number = table.column(named)
        order = np.argsort(number, kind="stable")
        odd = np.flatnonzero(~(np.diff(number[order], prepend=-np.inf) > 0))
        if odd.size:
            row = order[odd[0]]
            raise InvalidInput(
                f"{table.source} line {table.line[row]}: {named} is {number[row]:g}, but each row"
                " needs a number of its own. A table is of one antenna, without sums or means."
            )
    cells = [text for texts in table.words.values() for text in texts.tolist()]
    if sums := [text for text in cells if text.lower() in _SUMS]:
        raise InvalidInput(
            f"{table.source}: the row {sums[0]!r} is no segment. Leave sums and means out."
        )
    wide = table.find_quantity(("diameter", "width"), _LENGTHS)
    radius = wide[0] / 2 if wide else table.quantity(("diameter", "radius"), _LENGTHS)[0]
    radius = radius[order]
    if len(radius) > 1 and radius[-1] > radius[0]:
        text = (
            f"{table.source}: the last row is thicker than the first: does the table begin at the"
            " tip? Rows go from base to tip."
        )
        widths = f"{2e3 * radius[-1]:.4g} µm and {2e3 * radius[0]:.4g} µm."
        warnings.warn(ModelValidityWarning(text, widths), stacklevel=2)
    made = {
        "modulus": modulus,
        "density": density,
        "damping_time": damping_time,
        "name": Path(path).stem,
        **fields,
    }
    placed = table.find_quantity(("position", "distance", "x"), _LENGTHS)
    if placed is None:
        length = table.quantity(("length", "segment_length"), _LENGTHS)[0]
        return Antenna.from_beam(length=length[order], radius=radius, **made)
    place = placed[0][order]
    if place[0] < 0 or np.any(np.diff(place) <= 0):
        raise InvalidInput(
            f"{table.source}: positions must be distances from the base that rise, got"
            f" {place[0]:g} to {place[-1]:g} mm."
        )
    return Antenna.from_beam(
        length=float(place[-1]),
        n_segments=n_segments,
        radius=lambda x: np.interp(x * place[-1], place, radius),
        **made,
    )


# Force against deflection.

_BACK = (
    0.1  # [C] share of the largest force by which a curve may fall while the deflection grows
)
_SATURATED = 4.0  # [C] samples at the largest force, over those at any other
_KNOTS = 9  # forces at which the model's deflection is solved
STEEP = 0.85  # [C] deflection over arm beyond which a load slides off rather than bends


class ForceCurve(Shown, Record):
    """Force across an antenna at one point, and how far it moved that point aside.

    Attributes
    ----------
    deflection : np.ndarray
        (sample,) [mm]
    force : np.ndarray
        (sample,) [N]
    at : float
        Distance of the loaded point from the clamped base [mm].
    name : str
        The animal's.
    """

    DRAWN = "draw_force"

    deflection: Annotated[np.ndarray, "sample", Len(3), Unit("mm")]
    force: Annotated[np.ndarray, "sample", Unit("N")]
    at: Annotated[float, Gt(0), Unit("mm")]
    name: str = "animal"
    source: str = "force–deflection"

    def _check(self) -> None:
        if self.deflection.shape != self.force.shape:
            raise InvalidInput(
                f"{self.source}: one force for each deflection is needed, got {self.force.size} and"
                f" {self.deflection.size}."
            )
        if np.ptp(self.deflection) == 0 or np.ptp(self.force) == 0:
            what = "deflection" if np.ptp(self.deflection) == 0 else "force"
            raise InvalidInput(
                f"{self.source}: the {what} never changes, so nothing is measured."
            )
        if np.abs(self.deflection).max() > STEEP * self.at:
            raise InvalidInput(
                f"{self.source}: deflections up to {np.abs(self.deflection).max():.4g} mm are too"
                f" large for a point {self.at:.4g} mm from the base. Is the header's unit right (µm"
                " for mm), and at= in mm? Positions of a stage count from where it touches."
            )
        count = np.unique(np.abs(self.force), return_counts=True)[1]
        top = self.deflection[np.abs(self.force) == np.abs(self.force).max()]
        if count[-1] > _SATURATED * np.median(count) and np.ptp(top) > 0:
            raise InvalidInput(
                f"{self.source}: {count[-1]} samples have the largest force, as of a load cell at"
                " the end of its range. Leave these rows out."
            )
        order = np.argsort(self.deflection, kind="stable")
        rising = np.sign(np.polyfit(self.deflection, self.force, 1)[0]) or 1.0
        force = rising * self.force[order]
        off = np.abs(force - isotonic_regression(force))
        if off.max() > _BACK * np.ptp(force):
            where = self.deflection[order][int(np.argmax(off))]
            share = off.max() / np.ptp(force)
            raise InvalidInput(
                f"{self.source}: the curve is not monotone: near {where:.4g} mm the force is off by"
                f" {share:.0%} of its range. Did the contact slip? Leave that part out, and give"
                " loading and unloading as tables of their own."
            )


@checked
def load_forces(
    path: str | Path, *, at: Annotated[float, Gt(0)] | None = None, name: str = ""
) -> tuple[ForceCurve, ...]:
    """Curves of a table with columns ``force`` and ``deflection`` (or ``displacement``), whose
    headers say the units: ``force_uN``, ``deflection (mm)``.

    Forces in g are a balance's. A column ``at`` (with its unit), the distance of the loaded point
    from the base, gives a curve for each place; else it is ``at`` [mm]. ``name`` is the animal's,
    by default the file's; where a column ``animal``, ``individual``, ``specimen``, ``subject`` or
    ``id`` says whose a row is, that of the one to take, by default of all. A force that falls as
    the deflection grows is taken as the antenna's own on the load cell, with the opposite sign.

    Raises
    ------
    InvalidInput
        A column without a unit, no place, or a curve that is not monotone.
    """
    table = read_table(path, words=_OWNERS)
    deflection, _ = table.quantity(_DEFLECTION, _LENGTHS)
    force, _ = table.quantity(_FORCE, _FORCES)
    placed = table.find_quantity(("at", "arm", "place"), _LENGTHS)
    if placed is None and at is None:
        raise InvalidInput(
            f"{table.source} does not say where the force acts: give its distance from the base in"
            " mm (at=), or a column at_mm."
        )
    places = placed[0] if placed else np.full(len(table.values), at)
    who = np.full(len(places), name or Path(path).stem)
    owner = next((name for name in table.columns if name.lower() in _OWNERS), None)
    if owner is not None:
        who = table.words[owner]
        if name not in ("", *who):
            raise InvalidInput(
                f"{table.source}: no animal {name!r}; there are {', '.join(dict.fromkeys(who))}."
            )
    masks = {
        (str(animal), float(place)): (who == animal) & (places == place)
        for animal, place in sorted({*zip(who, places, strict=True)})
        if name in ("", animal)
    }
    # within a curve: a load nearer to the base moves less and takes more force
    falling = [
        mine
        for mine in masks.values()
        if (deflection[mine] - deflection[mine].mean()) @ force[mine] < 0
    ]
    if falling:
        warnings.warn(
            "forces fall as the deflection grows: taken with the opposite sign, as those of the"
            " antenna on the load cell.",
            ModelValidityWarning,
            stacklevel=2,
        )
        force = np.where(np.any(falling, axis=0), -force, force)
    return tuple(
        ForceCurve(
            deflection=deflection[mine],
            force=force[mine],
            at=place,
            name=animal,
            source=table.source,
        )
        for (animal, place), mine in masks.items()
    )


def is_force_table(path: str | Path, start: bytes | None = None) -> bool:
    """Whether a file, which begins so, is a table with columns of forces and deflections."""
    try:
        columns = sniff_columns(read_start(path, START) if start is None else start)
    except FeelerError:
        return False
    found = {split_unit(name)[0].lower() for name in columns}
    return bool(found & {*_FORCE} and found & {*_DEFLECTION})


@checked
def compute_force(
    antenna: Antenna, deflection: np.ndarray, at: Annotated[float, Gt(0)]
) -> np.ndarray:
    """Force (sample,) [N] along +x that holds the point ``at`` mm from the base aside by
    ``deflection`` (sample,) [mm], in equilibrium with all hinges.

    Exact at nine forces, with a cubic spline between them; for small deflections a uniform
    cantilever gives 3EI·δ/a³, a cone of radii r₀ at its base and r at the load 3EI₀·(r/r₀)·δ/a³.
    """
    if at > antenna.length * (1 + 1e-9):
        raise InvalidInput(
            f"the force acts {at:g} mm from the base, but {antenna.name!r} is"
            f" {antenna.length:.4g} mm long."
        )
    share = min(at / antenna.length, 1.0)
    asked = np.asarray(deflection, dtype=float)
    sign = 1.0 if abs(asked.max()) >= abs(asked.min()) else -1.0
    furthest = float(np.abs(asked).max())
    rest = compute_point(antenna, antenna.rest_angle, share)[0]

    def move(forces: Iterable[float]) -> np.ndarray:
        angles = [solve_static(antenna, (sign * force, 0.0), share) for force in forces]
        return sign * np.array([compute_point(antenna, one, share)[0] - rest for one in angles])

    arm = np.clip(at - antenna.hinge_position, 0.0, None)
    compliance = float(np.sum(arm**2 / antenna.stiffness))
    largest = furthest / compliance
    for _ in range(40):
        if move([largest])[0] >= furthest:
            break
        largest *= 1.3
    else:
        raise FeelerError(
            f"no force holds {antenna.name!r} {furthest:g} mm aside at {at:g} mm from its base."
        )
    forces = largest * np.linspace(0.0, 1.0, _KNOTS) ** 1.5
    there = np.concatenate([[0.0], move(forces[1:])])
    curve = CubicSpline(there, forces)
    inside = np.abs(asked) * (np.sign(asked) == sign)
    return sign * np.where(inside > 0, curve(inside), sign * asked / compliance)


_AGREE = 0.25  # [C] of how far a place is off, by which the places beside it may differ
_STRAY = (
    0.1,
    5.0,
)  # [C] of the antenna's length, and times what is usual: a place off its path
_STILL = 0.02  # [C] share of the tip's motion by which a base moves that is clamped


class Film(Shown, Record):
    """Points of one antenna in every frame of a film, and where it rests.

    Attributes
    ----------
    position : np.ndarray
        (frame, point, 2), y upwards, relative to the base where that was tracked [``unit``].
    bridged : np.ndarray
        Frames in which a point was lost and is filled in (frame, point).
    place : np.ndarray
        Places (point,) as fractions of the length; 0 is the base.
    interval : float
        Between frames [ms].
    origin : np.ndarray
        Where the base is in the film (2,) [``unit``].
    first : int
        Number of the first frame in the film.
    """

    DRAWN = "draw_film"

    position: Annotated[np.ndarray, "frame point axis"]
    bridged: Annotated[np.ndarray, "frame point"]
    place: Annotated[np.ndarray, "point"]
    interval: Annotated[float, Gt(0), Unit("ms")]
    origin: Annotated[np.ndarray, "axis"]
    name: str = "animal"
    unit: str = "px"
    first: int = 0
    source: str = "recorded"

    @property
    def time(self) -> np.ndarray:
        """Time (frame,) since the first frame [ms]."""
        return np.arange(len(self.position)) * self.interval

    @cached_property
    def rest(self) -> np.ndarray:
        """Where each point comes to rest (point, 2): the median of the last fifth."""
        return np.array(
            [[find_rest(row) for row in point.T] for point in self.position.swapaxes(0, 1)]
        )

    @property
    def reach(self) -> float:
        """From the first to the outermost point at rest [``unit``]."""
        return float(np.linalg.norm(self.rest[-1] - self.rest[0]))

    @cached_property
    def axes(self) -> np.ndarray:
        """Along the antenna at rest, and across it towards where it is at first (2, 2), unit rows.

        Across is the line through a single point's positions, where no base was tracked.
        """
        moved = self.position[:, -1] - self.rest[-1]
        if len(self.place) > 1 and self.place[0] == 0:
            along = self.rest[-1] - self.rest[0]
        else:
            across = np.linalg.svd(moved, full_matrices=False)[2][0]
            along = np.array([-across[1], across[0]])
        along = along / np.linalg.norm(along)
        across = np.array([along[1], -along[0]])
        first = float(np.median(moved[:5] @ across))
        peak = moved @ across
        side = first if abs(first) > 0.2 * np.abs(peak).max() else peak[np.abs(peak).argmax()]
        return np.array([along, across * (1.0 if side >= 0 else -1.0)])

    @property
    def displacement(self) -> np.ndarray:
        """Displacement across the resting antenna (point, frame) [``unit``], without the base."""
        moved = (self.position - self.rest) @ self.axes[1]
        return moved.T[self.place > 0]

    def match_protocol(self, antenna: Antenna, protocol: Protocol) -> Protocol:
        """The protocol that holds the outermost point of ``antenna`` as far aside as the film's;
        as it is where neither the base was tracked nor a scale is known.
        """
        if self.place[0] > 0 and self.unit != "mm":
            return protocol
        unit = self.reach / (antenna.length * self.place[-1]) if self.place[0] == 0 else 1.0
        held = abs(float(np.median(self.displacement[-1, :5]))) / unit
        rest = compute_point(antenna, antenna.rest_angle, self.place[-1])
        for _ in range(3):
            angle = hold(antenna, protocol.at, protocol.deflection)
            aside = abs(compute_point(antenna, angle, self.place[-1])[0] - rest[0])
            deflection = min(protocol.deflection * held / aside, 0.7 * protocol.at)
            protocol = protocol.replace(deflection=deflection)
        return protocol

    def make_traces(self, *, release: bool = True) -> Traces:
        """The displacements as traces of this animal, cut at the release where one is asked for."""
        keep = self.place > 0
        ends = ["" if place == 1 else f"@{place:.4g}" for place in self.place[keep]]
        names = tuple(f"{self.name}{end}" for end in ends)
        traces = Traces(
            time=self.time,
            displacement=self.displacement,
            names=names,
            source=self.source,
            bridged=self.bridged.T[keep],
        )
        return cut_at_release(traces) if release else traces


@checked
def load_film(
    path: str | Path,
    points: Sequence[str],
    *,
    scale: Annotated[float, Gt(0)] | None = None,
    max_gap: int = MAX_GAP,
    name: str = "",
    **options: Any,
) -> Film:
    """Points along an antenna from any tracker's file that :func:`feeler.tracking.load_tracks`
    reads.

    Parameters
    ----------
    points
        Landmarks from base to tip, as in ``("base", "tip")``. The first is where the antenna is
        clamped, where there are several and no place is said for it. The last is the tip unless its
        place is said: ``mid@0.5`` is at half the length. Places that are not said are those of the
        resting antenna in the film.
    scale
        Pixels per mm; only shapes are fitted, so none is needed.
    max_gap
        Longest gap that is filled in [frames]; what is filled in does not count in a fit.
    name
        The animal's; default: the file's.
    options
        Of ``load_tracks``: frame_rate, individual, min_likelihood, origin, plane.

    Raises
    ------
    InvalidInput
        A landmark that there is not, a longer gap, or what ``load_tracks`` refuses.
    """
    tracks = load_tracks(path, **options)
    if scale is not None:
        tracks = tracks.scaled(scale)
    return make_film(tracks, points, max_gap=max_gap, name=name or Path(path).stem)


@checked
def make_film(
    tracks: Tracks, points: Sequence[str], *, max_gap: int = MAX_GAP, name: str = "animal"
) -> Film:
    """As :func:`load_film`, from tracks that are read already."""
    if not points:
        raise InvalidInput(
            "points must name the landmarks along the antenna, base to tip: base,tip."
        )
    names = [point.partition("@")[0].strip() for point in points]
    for one in names:
        if one not in tracks.landmarks:
            near = suggest(one, tracks.landmarks)
            raise InvalidInput(
                f"no landmark {one!r}.{near} There are {', '.join(tracks.landmarks[:24])}."
            )
    said = [read_place(point, "point") if "@" in point else None for point in points]
    position = np.stack([tracks.of(one)[:, :2] for one in names], axis=1)
    lost = np.isnan(position).any(axis=2)
    whole = np.flatnonzero(~lost.any(axis=1))
    if whole.size < 10:
        raise InvalidInput(
            f"{name}: {', '.join(names)} are seen together in {whole.size} frames, 10 or more are"
            " needed. Lower min_likelihood=, or choose other points."
        )
    part = slice(whole[0], whole[-1] + 1)
    position, lost = position[part], lost[part]
    stray = _find_strays(position)
    if stray.any():
        text = (
            "places that are off their path in a single frame are left out, as tracking errors."
        )
        where = [
            f"{one} in frame {', '.join(map(str, whole[0] + np.flatnonzero(row)))}"
            for one, row in zip(names, stray.T, strict=True)
            if row.any()
        ]
        warnings.warn(ModelValidityWarning(text, f"{name}: {'; '.join(where)}."), stacklevel=3)
        lost = lost | stray
    flat = np.where(lost[..., None], np.nan, position).reshape(len(position), -1)
    filled = bridge(flat, max_gap, [one for one in names for _ in "xy"], name, int(whole[0]))
    position, origin = filled.reshape(position.shape), np.zeros(2)
    if len(names) > 1 and said[0] in (None, 0.0):
        said[0] = 0.0
        base = position[:, 0]
        origin = np.median(base, axis=0)
        swing = np.ptp(position[:, -1], axis=0).max()
        wander = np.linalg.norm(base - origin, axis=1)
        noise = np.linalg.norm(np.diff(base, 2, axis=0).std(axis=0)) / np.sqrt(6.0)
        if np.ptp(position[:, 0], axis=0).max() > 2 * swing:
            raise InvalidInput(
                f"{name}: {names[0]} moves more than {names[-1]}, but points go from the clamped"
                f" base to the tip. Give {','.join(reversed(names))}?"
            )
        still = np.percentile(wander, 90) <= max(_STILL * swing, 2.5 * noise)
        position = position - (origin if still else base[:, None])
    if said[-1] is None:
        said[-1] = 1.0
    film = Film(
        position=position,
        bridged=lost,
        place=np.ones(len(names)),
        interval=tracks.interval,
        origin=origin,
        name=name,
        unit=tracks.unit,
        first=int(whole[0]),
        source="synthetic" if tracks.source == "synthetic" else "recorded",
    )
    return film.replace(place=_find_places(said, film.rest))


def _find_strays(position: np.ndarray) -> np.ndarray:
    """Whether a point (frame, point) is far from where both frames beside it agree that it is, and
    farther than a swing goes in a frame there.
    """
    length = np.linalg.norm(np.nanmedian(position[:, -1] - position[:, 0], axis=0))
    off = np.linalg.norm(position[1:-1] - (position[2:] + position[:-2]) / 2, axis=2)
    agree = np.linalg.norm(position[2:] - position[:-2], axis=2) < _AGREE * off
    usual = np.stack([find_usual(row) for row in np.nan_to_num(off).T], axis=1)
    wrong = agree & (off > _STRAY[0] * length) & (off > _STRAY[1] * usual) & (length > 0)
    return np.pad(wrong, ((1, 1), (0, 0)))


def _find_places(said: Sequence[float | None], rest: np.ndarray) -> np.ndarray:
    """Places (point,) where not all are said: by the distance along the resting points."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1))])
    known = [k for k, place in enumerate(said) if place is not None]
    step = np.diff(rest, axis=0)
    turn = np.sum(step[1:] * step[:-1], axis=1)
    back = turn < -0.5 * np.prod(
        [np.linalg.norm(part, axis=1) for part in (step[1:], step[:-1])], 0
    )
    if known[0] != 0:
        raise InvalidInput(
            "without a tracked base the places of points are not known: say them, as in mid@0.5."
        )
    place = np.interp(arc, arc[known], [float(said[k] or 0.0) for k in known])
    if np.any(np.diff(place) <= 0) or np.any(back):
        raise InvalidInput(
            "points must go from base to tip, each farther out than the one before; one of these"
            " goes back."
        )
    return place


@checked
def join_films(films: Sequence[Film]) -> Traces:
    """The releases of several animals as one set of traces, as long as the shortest.

    Raises
    ------
    InvalidInput
        Two films of one animal, or films of different frame rates.
    """
    parts = [film.make_traces() for film in films]
    steps = {round(film.interval, 6) for film in films}
    if len(steps) > 1:
        rates = ", ".join(f"{film.name} {1e3 / film.interval:.4g}" for film in films)
        raise InvalidInput(
            f"films of different frame rates cannot be fitted together ({rates} frames/s); fit them"
            " one by one, or in feeler animal."
        )
    names = [name for part in parts for name in part.names]
    if len({*names}) < len(names):
        raise InvalidInput(f"each animal needs a name of its own, got {', '.join(names)}.")
    count = min(part.time.size for part in parts)
    return parts[0].replace(
        time=parts[0].time[:count],
        displacement=np.concatenate([part.displacement[:, :count] for part in parts]),
        bridged=np.concatenate([part.bridged[:, :count] for part in parts]),
        names=tuple(names),
    )


# What ``feeler info`` says of such tables.


def _tell_traces(path: Path, limits: Any, trusted: bool) -> list[str]:
    columns = read_table(path).columns
    counted = "frame" in columns and not any(find_times(columns).values())
    found = load_traces(
        path, frame_rate=1e3 if counted else None, release="found" if counted else "first"
    )
    rate = " --frame-rate RATE" if counted else ""
    clock = "frames" if counted else f"samples, 1 every {found.time[1]:.4g} ms"
    return [
        f"traces      {', '.join(found.names[:12])}",
        f"since       the release: {found.time.size} {clock}",
        f"next        feeler calibrate --data {quote(path.name)}{rate}",
    ]


def _tell_forces(path: Path, limits: Any, trusted: bool) -> list[str]:
    curves = load_forces(path, at=1e9)
    spans = [
        f"{what:11} {min(ends):.4g} … {max(ends):.4g} [{unit}]"
        for what, unit in (("deflection", "mm"), ("force", "N"))
        for ends in [[f(getattr(one, what)) for one in curves for f in (min, max)]]
    ]
    return [
        f"animals     {', '.join(dict.fromkeys(one.name for one in curves))}",
        *spans,
        f"next        feeler calibrate --data {quote(path.name)} --at MM --antenna ANTENNA",
    ]


def _tell_segments(path: Path, limits: Any, trusted: bool) -> list[str]:
    found = load_microscope(path, modulus=1.0)
    return [
        f"segments    {found.n_segments}, {found.length:.4g} mm in all",
        f"diameter    {2 * found.radius[0]:.4g} (base) … {2 * found.radius[-1]:.4g} mm",
        f"next        feeler antenna NEW.toml --from {quote(path.name)} --modulus MPA",
    ]


_DETECT = PLAIN_TABLES["table"].detect
CALIBRATION_FILES = {
    words: Format(words=words, kind="traces", detect=detect, load=load, tell=list)
    for words, detect, load in (
        ("force against deflection", is_force_table, _tell_forces),
        ("segments of an antenna", _DETECT, _tell_segments),
        ("traces of released antennae", _DETECT, _tell_traces),
    )
}
