"""Bend an antenna with static forces."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.disk.provenance import LICENCE, list_versions, write_canonical
from feeler.errors import InvalidInput
from feeler.physics.statics import solve_static
from feeler.records.checked import checked
from feeler.tensors.dataset import label_units


@checked
def bend(antenna: Antenna, force: float | Sequence[float], at: float = 1.0) -> xr.Dataset:
    """Static posture under a dead force along +x at a fraction of the length.

    Solves the equilibrium of all hinge torques directly, for any deflection; small forces on a
    uniform antenna give the cantilever ``F L³ / 3EI``, large ones the elastica.

    Parameters
    ----------
    force
        One or several forces [N], each a separate load case (dim ``load``).
    at
        Where the force acts, as a fraction of the length.

    Returns
    -------
    xarray.Dataset
        ``angle`` (load, hinge) [rad], ``points`` (load, joint, axis) [mm] from base to tip, ``tip``
        (load, axis) [mm], coordinate ``force`` [N].
    """
    forces = np.atleast_1d(np.asarray(force, dtype=float))
    if forces.ndim != 1 or not forces.size:
        raise InvalidInput(
            f"force must be one force or a row of them [N], got shape {forces.shape}."
        )
    angle = np.stack([solve_static(antenna, (value, 0.0), at) for value in forces])
    points = antenna.shape(angle)
    dataset = xr.Dataset(
        {
            "angle": (("load", "hinge"), angle),
            "points": (("load", "joint", "axis"), points),
            "tip": (("load", "axis"), points[:, -1]),
        },
        {
            "force": ("load", forces),
            "hinge": np.arange(1, antenna.n_segments + 1),
            "axis": ["x", "y"],
        },
    )
    dataset["points"].attrs["units"] = "mm"
    made_with = {
        "configuration": write_canonical({"antenna": antenna}),
        "versions": write_canonical(list_versions()),
    }
    dataset = label_units(dataset)
    return dataset.assign_attrs(at=at, antenna=antenna.name, licence=LICENCE, **made_with)
