"""``dataset.feeler``: what is most often asked of a Dataset of touches, in one word each."""

import json
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput

_VIEWS = "feeler.plotting.results"  # named, not imported: who only analyses needs no pictures


@xr.register_dataset_accessor("feeler")
class Views:
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
        :func:`feeler.tensors.posture.reconstruct_posture`.
        """
        from feeler.tensors.posture import reconstruct_posture

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
