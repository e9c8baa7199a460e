"""A touch of the run as a drawing: the antenna and the object at one moment, to scale."""

from collections.abc import Sequence

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from feeler.antenna.segments import Antenna
from feeler.objects import Trial, place
from feeler.plotting.antennas import MovingAntenna, make_patch
from feeler.tensors.transforms import compute_bend, in_unit, reconstruct_posture


def find_touch(touches: Sequence[Trial], speed: float) -> int:
    """The number of a touch that shows most: of the first kind of object the greater one, at the
    place nearest the base.
    """
    asked = [k for k, one in enumerate(touches) if one.speed == speed]
    kind = touches[asked[0]].feature.kind
    same = [k for k in asked if touches[k].feature.kind == kind]
    return min(same, key=lambda k: (touches[k].location, -touches[k].feature.size))


def draw_moment(
    antenna: Antenna,
    trial: Trial,
    tensors: xr.Dataset,
    now: int,
    ax: Axes,
    norm: Normalize,
) -> MovingAntenna:
    """Antenna and object at sample ``now`` of a touch, coloured by its curvature, without frame;
    ``tensors`` holds this one touch.
    """
    reach = antenna.length
    left = max(0.16 * reach, 2.2 * trial.feature.size)
    ax.set(xlim=(-left, 0.86 * reach), ylim=(-0.03 * reach, 1.08 * reach), aspect="equal")
    ax.axis("off")
    placed, time = place(antenna, trial), in_unit(tensors["time"], "ms").values[now]
    ax.add_patch(
        make_patch(trial.shape, placed.origin + placed.velocity * time, placed.forward)
    )
    drawn = MovingAntenna(antenna, ax, norm)
    posture = reconstruct_posture(tensors, antenna).values[0, now]
    drawn.move(posture, compute_bend(tensors, antenna)[now])
    return drawn
