"""Draw bases: what an encoder takes touches to be made of."""

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from feeler.plotting.tensor import plot_tensor_grid
from feeler.records.checked import checked


@checked
def plot_bases(
    sets: Mapping[str, Annotated[np.ndarray, "component sensor lag"]], sampling: float, ax: Axes
) -> None:
    """A row of bases for each set (component, sensor, lag), base to tip upwards; each basis on its
    own colour scale.

    ``sampling`` [ms]. Shorter bases stand among longer ones on one scale of lags.
    """
    shape = np.max([components.shape for components in sets.values()], axis=0)
    grid = [
        [_pad(components, m, shape[1:]) for m in range(shape[0])]
        for components in sets.values()
    ]
    columns = [f"basis {m + 1}" for m in range(shape[0])]
    image = plot_tensor_grid(
        grid,
        sampling * np.arange(shape[2]),
        ax,
        Normalize(0, 1),
        list(sets),
        columns,
        "of the basis' greatest",
    )
    ax.set(xlabel="lag [ms]", ylabel="sensor (base → tip upwards)")
    if (figure := ax.get_figure(root=False)) is not None:
        figure.colorbar(
            image,
            ax=ax,
            label="share of each basis' greatest value",
            location="bottom",
            aspect=40,
            pad=0.02,
        )


def _pad(components: np.ndarray, m: int, shape: np.ndarray) -> np.ndarray:
    """Basis ``m`` as a share of its greatest value, in an otherwise empty (sensor, lag); empty if
    there is none.
    """
    padded = np.full(shape, np.nan)
    if m < len(components):
        basis = components[m]
        padded[: basis.shape[0], : basis.shape[1]] = basis / (basis.max() or 1)
    return padded
