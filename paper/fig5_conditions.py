"""Fig. 5E as a drawing: the speeds and the profiles that are compared, in touches of the run."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler.antenna.segments import Antenna
from feeler.objects import Trial
from feeler.objects.trials import SPEEDS
from feeler.plotting.style import mark_panels, pick_colours, set_decades
from feeler.report.page import Section
from feeler.tensors.transforms import compute_bend, in_unit
from paper.context import Context
from paper.data import list_profiles, list_speeds, list_touches, load_tensors
from paper.fig1_touch import draw_moment, find_touch

_PUSHED = 9.0  # mm that the object has moved since contact, at every profile
_LATER = 15.0  # ms since contact, at every speed

_Touch = tuple[Antenna, Trial, xr.Dataset, float]
"""With the moment that is drawn [ms since contact]."""


def _collect(context: Context) -> dict[str, dict[str, _Touch]]:
    """One touch of each profile at the slow speed, and of the first profile at each speed."""
    profiles, slow = list_profiles(context), SPEEDS["slow"]
    first = profiles[0]
    return {
        "profiles": {p: _take(context, p, slow, _PUSHED / slow) for p in profiles},
        "speeds": {
            f"{name}, {speed:g} m/s": _take(context, first, speed, _LATER)
            for name, speed in sorted(
                list_speeds(context, first).items(), key=lambda item: item[1]
            )
        },
    }


def _take(context: Context, profile: str, speed: float, moment: float) -> _Touch:
    touches = list_touches(context, profile)
    number = find_touch(touches, speed)
    tensors = load_tensors(context, profile).isel(trial=[number])
    return context.profiles[profile], touches[number], tensors, moment


def plot(found: Mapping[str, Mapping[str, _Touch]], figure: Figure) -> None:
    """Profiles and their touches above, touches at each speed below."""
    profiles, speeds = found.values()
    bends = [compute_bend(t, a)[_find(t, m, trial)].max() for a, trial, t, m in _list(found)]
    norm = Normalize(0.0, max(*map(float, bends), 1e-9))
    columns = 1 + max(len(profiles), len(speeds))
    axes = figure.subplots(2, columns, width_ratios=(1.2, *[1] * (columns - 1)))
    _draw_stiffness({name: touch[0] for name, touch in profiles.items()}, axes[0, 0])
    mark_panels(axes[0, 0], "e")
    _draw_ways([trial.speed for _, trial, _, _ in speeds.values()], axes[1, 0])
    for row, touches in zip(axes[:, 1:], (profiles, speeds), strict=True):
        for ax, (name, (antenna, trial, tensors, moment)) in zip(
            row, touches.items(), strict=False
        ):
            now = _find(tensors, moment, trial)
            drawn = draw_moment(antenna, trial, tensors, now, ax, norm)
            ax.set_title(name)
        for ax in row[len(touches) :]:
            ax.axis("off")
    figure.colorbar(drawn.colours, ax=axes[:, 1:], label="curvature [1/mm]", pad=0.01)


def _list(found: Mapping[str, Mapping[str, _Touch]]) -> list[_Touch]:
    return [touch for touches in found.values() for touch in touches.values()]


def _find(tensors: xr.Dataset, moment: float, trial: Trial) -> int:
    """The sample at a moment [ms since contact], or the last one."""
    time = in_unit(tensors["time"], "ms").values
    return min(int(np.searchsorted(time, trial.lead + moment)), time.size - 1)


def _draw_stiffness(antennas: Mapping[str, Antenna], ax: Axes) -> None:
    """Stiffness along every profile."""
    for name, colour in pick_colours(antennas).items():
        one = antennas[name]
        ax.plot(one.hinge_position / one.length, one.stiffness, color=colour, label=name)
    ax.legend(loc="lower left", borderpad=0.1)
    set_decades(ax)
    ax.set(xlabel="location (base 0, tip 1)", ylabel="stiffness [N·mm/rad]")


def _draw_ways(speeds: list[float], ax: Axes) -> None:
    """How far an object has come over time, at every speed."""
    time = np.array([0.0, 40.0])
    for speed, colour in zip(
        speeds, pick_colours(f"{s:g} m/s" for s in speeds).values(), strict=True
    ):
        ax.plot(time, speed * time, color=colour, label=f"{speed:g} m/s")
    ax.axvline(_LATER, color="#888888", ls=":", lw=0.8)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, columnspacing=0.8)
    ax.set(
        xlabel="time since contact [ms]", ylabel="distance since contact [mm]", ylim=(0, None)
    )


def show(context: Context, section: Section) -> None:
    """What is compared in most of what follows."""
    found = _collect(context)
    section.figure(
        "fig5e_conditions",
        "What is compared. Above: antennae that differ in stiffness only, each when the same slow"
        f" object has pushed it for {_PUSHED:g} mm. Below: one antenna and one object at each"
        f" speed, each {_LATER:g} ms after contact (dotted on the left). (Fig. 5E)",
        lambda figure: plot(found, figure),
        height=4.4,
        numbers={name: antenna.stiffness for name, (antenna, *_) in found["profiles"].items()},
    )
