"""An animal from its measurements: what can be computed of what there is, section by section."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from feeler.animal.plan import AnimalPlan, Films, load_animal
from feeler.antenna.files import load_antenna
from feeler.antenna.segments import Antenna
from feeler.calibration import (
    Film,
    ForceCurve,
    MeasurementFit,
    Measurements,
    Prediction,
    Protocol,
    Ratios,
    fit_measurements,
    load_film,
    load_forces,
    load_microscope,
    measure_impulse_film,
    predict_release,
)
from feeler.calibration.joint import compute_animal_spread
from feeler.errors import FeelerError, InvalidInput
from feeler.objects.bodies import Object
from feeler.objects.motion import BaseMotion
from feeler.objects.shapes import parse_feature
from feeler.objects.trials import Trial
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene, make_scene
from feeler.presets import PRESETS, make_preset
from feeler.progress import Advance
from feeler.records import Shown
from feeler.renamed import rename_antenna
from feeler.spikes import draw_spikes, find_gain, place_sensilla, read_trains
from feeler.tensors.schema import make_motion_tensors
from feeler.tracking import (
    Exploration,
    Tracks,
    load_tracks,
    make_base_motion,
    measure_exploration,
)
from feeler.tracking.posture import tabulate_contacts
from feeler.validation import checked
from feeler.wall import DISTANCES, NEAREST, DistanceMap, approach, map_distance
from feeler.wall.following import measure_scale

_NEEDS = {
    "antenna": "[microscope], or antenna = FILE",
    "fit": "[releases], [force] or [impulses], and an antenna",
    "prediction": "held_out films in [releases], and a fit",
    "kinematics": "[walks]",
    "touch": "[object], and an antenna; with the filmed base if [walks] has a scale",
    "wall": "[wall], and an antenna",
    "spikes": "[object], and an antenna; beside recorded ones if [spikes] names a file",
}
"""What each part is computed from."""
_ODD = 1.5  # [C] factor between the antenna's length in a film and by its segments
_LONGEST = 10_000.0  # [C] ms of a touch that is simulated
_SAMPLE = 0.5  # [C] ms; sensilla adapt too fast for 1 ms
_LET_GO = 10.0  # [C] ms without force that end a contact
_PRESSED = 1e-3  # [C] share of the largest force above which an antenna is in contact


@dataclass(kw_only=True, eq=False)
class AnimalStudy(Shown):
    """What was computed of an animal; None where nothing was.

    Attributes
    ----------
    start : Antenna | None
        Before the fit.
    antenna : Antenna | None
        The fitted antenna, or ``start`` where nothing was fitted.
    predictions : list[Prediction]
        Of films that were not used in the fit.
    spread : float
        Standard deviation between animals of the free response, as ``Prediction.error``.
    films : dict[str, Film]
        Releases that were fitted, by animal.
    held_out : dict[str, Film]
        Releases that were not.
    touch : xr.Dataset | None
        The touch of the object.
    contacts : pandas.DataFrame
    tip_error : float
        Root mean square distance of the simulated tip from the filmed one [mm].
    missing : dict[str, str]
        What was not computed, and what it needs.
    problems : dict[str, str]
        What was wrong with what there is.
    """

    DRAWN = "draw_study"

    plan: AnimalPlan
    start: Antenna | None = None
    antenna: Antenna | None = None
    animals: list[Measurements] = field(default_factory=list)
    films: dict[str, Film] = field(default_factory=dict)
    held_out: dict[str, Film] = field(default_factory=dict)
    fit: MeasurementFit | None = None
    predictions: list[Prediction] = field(default_factory=list)
    spread: float = float("nan")
    kinematics: Exploration | None = None
    touch: xr.Dataset | None = None
    contacts: pd.DataFrame = field(default_factory=pd.DataFrame)
    tip_error: float = float("nan")
    wall: DistanceMap | None = None
    spikes: dict[str, float] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)

    @property
    def spatial(self) -> Antenna | None:
        """The antenna in space."""
        return None if self.antenna is None else self.antenna.unflatten()

    @property
    def answer(self) -> str:
        """The main result: of the prediction, the fit or the antenna, whichever came last."""
        lines = self.describe()
        return next(
            (line for kind in ("prediction", "fit") for line in lines if line.startswith(kind)),
            lines[0],
        )

    def describe(self) -> list[str]:
        """What was found, a line each, and what was not computed."""
        lines = []
        if self.antenna is not None:
            one = self.antenna
            mass = 1e3 * one.segment_mass.sum()
            lines.append(
                f"antenna: {one.n_segments} segments, {one.length:.4g} mm, {mass:.3g} mg"
            )
        if self.fit is not None:
            lines += [f"fit: {words}" for words in self.fit.describe()]
        beside = "" if np.isnan(self.spread) else f"; animals differ by {self.spread:.1%}"
        lines += [
            f"prediction of {one.name}: off by {one.error:.1%} of the held displacement (before"
            f" the fit {one.error_before:.1%}{beside})"
            for one in self.predictions
        ]
        if self.kinematics is not None:
            speeds = ", ".join(
                f"{side} {1e3 * np.rad2deg(np.nanmean(row)):.1f}"
                for side, row in zip(
                    ("left", "right"), self.kinematics.mean_peak.T, strict=True
                )
                if np.isfinite(row).any()
            )
            lines.append(f"kinematics: mean peak speed {speeds} °/s")
        for one in self.contacts.itertuples():
            end = f"{one.off_ms:.4g} ms" if one.whole else "the end"
            lines.append(
                f"contact: {one.on_ms:.4g} ms to {end}, at {one.place:.2f} of the length"
            )
        if self.touch is not None and self.contacts.empty:
            lines.append("contact: none")
        if np.isfinite(self.tip_error):
            lines.append(f"tip: {self.tip_error:.3g} mm (r.m.s.) from the filmed one")
        if self.wall is not None:
            words = (
                self.wall.undefined or f"R² {self.wall.r2:.3f}, off by {self.wall.error:.3g} mm"
            )
            lines.append(f"wall: distance from the place of greatest curvature: {words}")
            lines.append(f"wall: this antenna {self.wall.bending}")
        lines += [f"spikes: {name} {value:.4g}" for name, value in self.spikes.items()]
        lines += [f"problem with {name}: {words}" for name, words in self.problems.items()]
        if self.plan.walks is not None and self.kinematics is not None:
            files = zip(self.plan.walks.files.values(), self.kinematics.remarks, strict=True)
            lines += [f"{file}: {' '.join(remarks)}" for file, remarks in files if remarks]
        return [
            *lines,
            *(f"not computed: {k} (needs {words})" for k, words in self.missing.items()),
        ]


@checked
def study_animal(
    plan: AnimalPlan | str | Path, *, progress: Advance | None = None
) -> AnimalStudy:
    """Everything that can be computed of what a plan names; a part at fault stops no other.

    Parameters
    ----------
    plan
        Or the path of its file.
    progress
        Called with (done, total) animals of the fit.
    """
    plan = plan if isinstance(plan, AnimalPlan) else load_animal(plan)
    study = AnimalStudy(plan=plan)
    walks: list[Tracks] = []
    steps: dict[str, Callable[[], None]] = {
        "antenna": lambda: _find_antenna(study),
        "measurements": lambda: _read_measurements(study),
        "fit": lambda: _fit(study, progress),
        "prediction": lambda: _predict(study),
        "kinematics": lambda: walks.extend(_measure_walks(study)),
        "touch": lambda: _touch(study, walks),
        "spikes": lambda: _fire(study),
        "wall": lambda: _meet_wall(study),
    }
    for name, step in steps.items():
        try:
            step()
        except FeelerError as error:
            study.problems[name] = str(error)
    found = {
        "antenna": study.antenna,
        "fit": study.fit,
        "prediction": study.predictions,
        "kinematics": study.kinematics,
        "touch": study.touch,
        "wall": study.wall,
        "spikes": study.spikes,
    }
    study.missing = {
        name: _NEEDS[name]
        for name, value in found.items()
        if name not in study.problems
        and (value is None or (isinstance(value, list | dict) and not value))
    }
    return study


def _find_antenna(study: AnimalStudy) -> None:
    plan = study.plan
    if plan.microscope is not None:
        table = plan.microscope
        study.start = load_microscope(
            plan.find(table.file),
            modulus=table.modulus,
            density=table.density,
            damping_time=table.damping_time,
            name=plan.name,
        )
    elif plan.antenna:
        name = rename_antenna(plan.antenna)
        made = make_preset(name) if name in PRESETS else load_antenna(plan.find(name))
        study.start = made.flatten().replace(name=plan.name)
    study.antenna = study.start


def _attempt(
    study: AnimalStudy, files: dict[str, str], read: Callable[[str, Path], Any]
) -> Any:
    """What can be read of files, by animal; a file at fault is noted, and left out."""
    found = {}
    for name, file in files.items():
        try:
            found[name] = read(name, study.plan.find(file))
        except FeelerError as error:
            study.problems[file] = str(error)
    return found


def _load(
    study: AnimalStudy, films: Films, files: dict[str, str], *, release: bool
) -> dict[str, Film]:
    """Films of the releases, each with one, or of impulses."""
    options: dict[str, Any] = {
        "frame_rate": films.frame_rate,
        "min_likelihood": films.min_likelihood,
        "individual": films.individual,
    }
    how: dict[str, Any] = {"scale": films.scale, "max_gap": films.max_gap, **options}

    def read(name: str, path: Path) -> Film:
        film = load_film(path, films.points, name=name, **how)
        if release:
            film.make_traces()
        length = study.start.length * film.place[-1] if study.start is not None else film.reach
        if film.unit == "mm" and not 1 / _ODD < film.reach / length < _ODD:
            study.problems[f"scale of {path.name}"] = (
                f"the antenna is {film.reach:.3g} mm long in the film, {length:.3g} mm by its"
                " segments. Is scale= [px/mm] right?"
            )
        return film

    return _attempt(study, files, read)


def _read_measurements(study: AnimalStudy) -> None:
    """Releases, forces and impulses by animal; an animal of which no force (impulse) was measured
    takes all others'.
    """
    plan = study.plan
    forces: dict[str, tuple[ForceCurve, ...]] = {}
    ratios: dict[str, tuple[Ratios, ...]] = {}
    if (films := plan.releases) is not None:
        study.films = _load(study, films, films.files, release=True)
        study.held_out = _load(study, films, films.held_out, release=True)
    if (table := plan.force) is not None:
        forces = _attempt(
            study, table.files, lambda name, path: load_forces(path, at=table.at, name=name)
        )
    if (films := plan.impulses) is not None:
        hits = _load(study, films, films.files, release=False)
        for name, film in hits.items():
            try:
                ratios[name] = (measure_impulse_film(film),)
            except FeelerError as error:
                study.problems[films.files[name]] = str(error)
    all_forces = tuple(one for some in forces.values() for one in some)
    all_ratios = tuple(one for some in ratios.values() for one in some)
    study.animals = [
        Measurements(
            name=name,
            releases=(study.films[name].make_traces(),) if name in study.films else (),
            forces=forces.get(name, all_forces),
            ratios=ratios.get(name, all_ratios),
        )
        for name in list(study.films) or list({**forces, **ratios})
    ]


def _make_protocol(study: AnimalStudy) -> Protocol:
    plan, antenna = study.plan, study.antenna
    if antenna is None:
        raise InvalidInput("no antenna is described: give [microscope] or antenna = FILE.")
    at = plan.releases.at if plan.releases is not None else None
    at = 0.25 * antenna.length if at is None else at
    if at >= antenna.length:
        raise InvalidInput(
            f"[releases] at = {at:g} mm is beyond the antenna's tip, {antenna.length:.4g} mm from"
            " the base."
        )
    return Protocol(
        at=at,
        deflection=0.1 * at,
        speed=plan.impulses.speed if plan.impulses is not None else 0.2,
    )


def _fit(study: AnimalStudy, progress: Advance | None) -> None:
    if not study.animals or study.start is None:
        return
    protocol = _make_protocol(study)
    animals = [
        animal.replace(
            deflection=study.films[animal.name].match_protocol(study.start, protocol).deflection
        )
        if animal.releases
        else animal
        for animal in study.animals
    ]
    study.fit = fit_measurements(animals, study.start, protocol=protocol, progress=progress)
    study.antenna = study.fit.antenna


def _predict(study: AnimalStudy) -> None:
    """Films that were not used in the fit, and how much the animals differ."""
    if study.antenna is None or study.plan.releases is None:
        return
    protocol = _make_protocol(study)
    study.spread = compute_animal_spread([film.make_traces() for film in study.films.values()])
    study.predictions = [
        predict_release(
            film.make_traces(),
            study.antenna,
            start=study.start,
            protocol=film.match_protocol(study.antenna, protocol),
        )
        for film in study.held_out.values()
    ]


def _measure_walks(study: AnimalStudy) -> list[Tracks]:
    walks = study.plan.walks
    if walks is None:
        return []
    tracks = [
        load_tracks(
            study.plan.find(file),
            frame_rate=walks.frame_rate,
            origin=walks.origin,
            individual=walks.individual,
        )
        for file in walks.files.values()
    ]
    study.kinematics = measure_exploration(
        tracks,
        length=None if study.antenna is None else study.antenna.length,
        landmarks={"tips": walks.tips, "head": walks.head, "abdomen": walks.abdomen},
    )
    return [one if walks.scale is None else one.scaled(walks.scale) for one in tracks]


def _touch(study: AnimalStudy, walks: Sequence[Tracks]) -> None:
    """The object touches the antenna, whose base moves as in the first walk that has a scale."""
    touched, how, antenna = study.plan.object, study.plan.walks, study.antenna
    if touched is None or antenna is None:
        return
    # The shape's words with the path of its file relative to the plan.
    kind, _, rest = touched.shape.partition(":")
    parts = [
        f"file={study.plan.find(part[5:])}" if part.startswith("file=") else part
        for part in rest.split(",")
    ]
    feature = parse_feature(f"{kind}:{','.join(parts)}" if rest else kind)
    if feature.only_in_space:
        antenna = antenna.unflatten()
    base = None
    if how is not None and how.scale is not None and walks:
        base = make_base_motion(
            walks[0],
            base=how.base or how.head,
            towards=tuple(how.towards or (how.abdomen, how.head))[:2],  # type: ignore[arg-type]
            angle=float(np.deg2rad(how.angle)),
            origin="film" if touched.landmark else "first",
        )
    scene, duration = _set_scene(study, antenna, feature, base, walks)
    clock = Clock(
        duration=duration,
        sample_interval=_SAMPLE,
        timestep=choose_timestep(None, DEFAULT_ENGINE, scene.contact),
    )
    motion = run_scene(scene, clock)
    trial: dict[str, list[object]] = {
        "feature": [feature.name],
        "size": [feature.size],
        "location": [touched.location],
        "speed": [touched.speed],
        "antenna": [antenna.name],
        "source": ["simulation"],
        "seed": [0],
    }
    study.touch = make_motion_tensors(antenna, [motion], trials=trial)
    # Contacts of a simulated touch, one a row as of :func:`feeler.tracking.find_contacts`:
    # where the force is above 1/1000 of the largest; a contact ends after 10 ms without.
    size, step = np.linalg.norm(motion.force, axis=1), float(np.diff(motion.time[:2])[0])
    least = max(_PRESSED * float(size.max()), 1e-15)
    gap = round(_LET_GO / step)
    study.contacts = tabulate_contacts(size, least, motion.contact_place, step, max_gap=gap)
    if touched.landmark and how is not None and base is not None and not antenna.spatial:
        study.tip_error = _compare_tip(walks[0], how, antenna, motion, base)


def _set_scene(
    study: AnimalStudy,
    antenna: Antenna,
    feature: Any,
    base: BaseMotion | None,
    walks: Sequence[Tracks],
) -> tuple[Scene, float]:
    """The object where it was tracked, or on its way to the antenna; and for how long [ms]."""
    touched = study.plan.object
    assert touched is not None
    end = _LONGEST if base is None or base.time is None else float(base.time[-1])
    if end > _LONGEST:
        study.problems["the touch"] = (
            f"the walk lasts {1e-3 * end:.3g} s, of which the first {1e-3 * _LONGEST:g} s are"
            " simulated. Cut the film to the contact."
        )
    end = min(end, _LONGEST)
    if not touched.landmark:
        trial = Trial(
            feature=feature, location=touched.location, speed=touched.speed, base=base
        )
        return make_scene(antenna, trial), min(antenna.length / touched.speed + 100.0, end)
    if base is None:
        raise InvalidInput(
            f"the object is at the landmark {touched.landmark!r}, but [walks] has no scale [px/mm]."
        )
    middle = np.nanmedian(walks[0].of(touched.landmark)[:, :2], axis=0)
    foremost = middle + np.array([feature.size, 0.0])
    item = Object(feature=feature, place=(float(foremost[0]), float(foremost[1])))
    scene = Scene(
        antenna=antenna,
        objects=(item,),
        contact=get_contact(None, antenna),
        base_motion=base,
        label=f"{feature.name} beside a filmed animal",
    )
    return scene, end


def _compare_tip(
    walk: Tracks, how: Any, antenna: Antenna, motion: Any, base: BaseMotion
) -> float:
    """Distance of the simulated tip from the filmed one [mm], r.m.s."""
    tips = how.tips[::-1] if how.angle > 0 else how.tips  # right, left
    name = next((tip for tip in tips if tip in walk.landmarks), "")
    if not name or base.time is None:
        return float("nan")
    filmed = walk.of(name)[:, :2]
    seen = [
        walk.of(one)
        for one in {how.base or how.head, *(how.towards or (how.abdomen, how.head))}
    ]
    whole = np.flatnonzero(np.isfinite(np.concatenate(seen, axis=1)).all(axis=1))
    filmed = filmed[whole[0] : whole[0] + base.time.size]
    pairs = zip(motion.angle, motion.base, strict=True)
    tip = np.array([pose[:2] + antenna.tip(angle, pose[2]) for angle, pose in pairs])
    there = np.column_stack([np.interp(motion.time, base.time, row) for row in filmed.T])
    return float(np.sqrt(np.nanmean(np.sum((tip - there) ** 2, axis=1))))


def _fire(study: AnimalStudy) -> None:
    """Spikes of sensilla along the antenna in this touch; how many were recorded."""
    if study.touch is None:
        return
    touch = study.touch
    if study.contacts.empty:  # a gain by the greatest rate would be that of rounding errors
        study.missing["simulated spikes"] = "an object that the antenna meets"
    else:
        sensilla = place_sensilla(
            touch["position"].values,
            30.0,
            around=np.array((0.0, 90.0) if "plane" in touch.dims else (0.0,)),
        )
        times = draw_spikes(find_gain(touch, sensilla).encode(touch), seed=0)["spike_time"]
        study.spikes = {"simulated": float(np.isfinite(times.values).sum())}
    if study.plan.spikes is None:
        return
    trains = read_trains(study.plan.find(study.plan.spikes.file))
    for name, train in trains.items():
        unit = f" of {name}" if len(trains) > 1 else ""
        study.spikes[f"recorded{unit}"] = float(train.size)
        if train.size > 1:
            study.spikes[f"recorded rate{unit} [Hz]"] = 1e3 * train.size / float(np.ptp(train))


def _meet_wall(study: AnimalStudy) -> None:
    """How well the wall's distance is read from the place of greatest curvature."""
    if study.plan.wall is None or study.antenna is None:
        return
    antenna = study.antenna
    posture = NEAREST.replace(inter_antennal_angle=study.plan.wall.angle)
    study.wall = map_distance(
        approach(antenna, posture, measure_scale(antenna) * np.asarray(DISTANCES))
    )
