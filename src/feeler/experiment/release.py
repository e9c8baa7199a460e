"""Hold an antenna to one side, let it go, and watch it swing."""

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.antenna.space import require_plane
from feeler.disk.provenance import LICENCE, list_versions, make_plain
from feeler.errors import FeelerError, InvalidInput
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import run_scene
from feeler.physics.scene import Scene
from feeler.physics.statics import compute_point, solve_static
from feeler.records.checked import checked
from feeler.tensors.dataset import make_motion_tensors


@checked
def release(
    antenna: Antenna,
    at: float = 10.0,
    deflection: float = 1.0,
    *,
    duration: float = 200.0,
    sample_interval: float = 0.1,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    angle: np.ndarray | None = None,
) -> xr.Dataset:
    """Free response after a step: the antenna held aside at one point, at rest, then released at
    time 0.

    Parameters
    ----------
    at
        Arc length from the base of the point that is held [mm] (10 mm in the animal experiments,
        Methods).
    deflection
        How far that point is held aside, along +x [mm].
    duration, sample_interval, timestep
        [ms].
    angle
        Start from these hinge angles (segment,) [rad] instead of a held posture.

    Returns
    -------
    xarray.Dataset
        One trial with ``angle``, ``curvature`` (trial, sensor, time) of every hinge and ``tip``
        (trial, time, axis) [mm].
    """
    require_plane(antenna, "release")
    start = hold(antenna, at, deflection) if angle is None else _check_start(antenna, angle)
    clock = Clock(
        duration=duration,
        sample_interval=sample_interval,
        timestep=choose_timestep(timestep, engine),
    )
    scene = Scene(antenna=antenna, angle=start, label=f"release of {antenna.name}")
    motion = run_scene(scene, clock, engine)
    trial: dict[str, list] = {
        "feature": ["release"],
        "size": [0.0],
        "location": [at / antenna.length],
        "speed": [0.0],
    }
    made_with = {
        "antenna": antenna,
        "clock": clock,
        "engine": engine,
        "at": at,
        "deflection": deflection,
    }
    whole = antenna.replace(sensors=np.arange(1, antenna.n_segments + 1))
    return make_motion_tensors(
        whole,
        [motion],
        trials=trial | {"antenna": [antenna.name], "source": ["simulation"], "seed": [0]},
        attrs={
            "configuration": make_plain(made_with),
            "engine": engine,
            "versions": list_versions(),
            "timestep": clock.timestep,
            "timestep_units": "ms",
            "licence": LICENCE,
        },
    )


def hold(antenna: Antenna, at: float, deflection: float) -> np.ndarray:
    """Hinge angles (segment,) [rad] of an antenna pushed aside by ``deflection`` [mm] along +x at
    arc length ``at`` [mm].

    The force that does it is found by the secant method on the exact statics.
    """
    if not (np.isfinite(deflection) and abs(deflection) < at):
        raise InvalidInput(
            f"deflection must be smaller than `at` = {at:g} mm, got {deflection} mm."
        )
    share = at / antenna.length
    rest = compute_point(antenna, antenna.rest_angle, share)[0]
    forces, places = [0.0, 1e-6], [0.0]
    for _ in range(60):
        angle = solve_static(antenna, (forces[-1], 0.0), share)
        places.append(compute_point(antenna, angle, share)[0] - rest)
        if abs(places[-1] - deflection) <= 1e-10 * max(abs(deflection), 1e-3):
            return angle
        slope = (places[-1] - places[-2]) / (forces[-1] - forces[-2])
        forces.append(forces[-1] + (deflection - places[-1]) / slope)
    raise FeelerError(
        f"no force holds the antenna {deflection:g} mm aside at {at:g} mm; use a smaller"
        " deflection."
    )


def _check_start(antenna: Antenna, angle: np.ndarray) -> np.ndarray:
    angle = np.asarray(angle, dtype=float)
    if angle.shape != (antenna.n_segments,) or not np.all(np.isfinite(angle)):
        raise InvalidInput(
            f"angle must be {antenna.n_segments} finite numbers [rad], got shape {angle.shape}."
        )
    return angle
