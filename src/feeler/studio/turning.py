"""A touch of an antenna in space: computed whole, shown as a view that is turned by hand."""

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.experiment.touch import touch
from feeler.physics.contact import get_contact
from feeler.studio.wish import PREVIEW, TouchWish


def touch_in_space(wish: TouchWish) -> xr.Dataset:
    """The touch, with every hinge as a sensor.

    Raises
    ------
    InvalidInput
        Further objects, which the view does not draw.
    """
    if wish.objects:
        raise InvalidInput(
            "the studio shows one object beside an antenna in space; take the others away, or touch"
            " it by feeler.Simulation."
        )
    antenna = wish.antenna.make_any()
    preview = get_contact(None, antenna).scale_timestep(PREVIEW)
    return touch(
        antenna,
        wish.make_trial(),
        duration=wish.duration,
        timestep=preview if wish.preview else None,
        all_hinges=True,
    )


def fold_sensors(antenna: Antenna, angle: np.ndarray) -> np.ndarray:
    """The tensor (sensor, time) of angles (plane, segment, time): the sensors of one plane after
    those of the other.
    """
    return angle[:, antenna.sensors - 1].reshape(-1, angle.shape[-1])
