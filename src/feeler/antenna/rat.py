"""The thirty whiskers of a side of the average rat, in space, where they stand on its cheek.

Numbers [B] are those of WHISKiT (Zweifel et al. 2021, doi:10.1073/pnas.2011905118), after Belli et
al. 2018 (doi:10.1371/journal.pone.0194981): arc length S [mm], the parabola A [1/mm] in which a
whisker lies, the place of its base [mm] and its angles [rad], in ``rat_whiskers.csv``; diameter at
the base, slope of the radius, modulus and density. WHISKiT's program halves the radius at the tip
once more than its equation says; here the equation is used. Choices [C] are the radius of the
thinnest tips and that all first modes have the damping ratio 0.14, the middle of what Hartmann et
al. 2003 measured (doi:10.1523/JNEUROSCI.23-16-06510.2003) of whiskers whose base was held fast.

Bases are clamped, as WHISKiT clamps them: it gives the first link springs of 1.25 and locks them.
``FOLLICLE`` is a choice [C]; a follicle's stiffness was not found published in numbers. Tissue of
some 10 kPa holds some 3 mm of shaft, equally in all directions, and springs back within 1 ms.
"""

from functools import cache
from importlib.resources import files
from typing import Annotated, Literal, NamedTuple

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.follicle import Follicle
from feeler.antenna.modes import compute_modes
from feeler.antenna.space import to_vector
from feeler.records.checked import checked

_MODULUS = 5000.0  # MPa [B]
_DENSITY = "1.26e-3 + 0.43e-3 * x"  # g/mm³ [B]
_THINNEST = 0.0015  # mm, radius of a tip [C]
_DAMPING_RATIO = 0.14  # [B+C]
FOLLICLE = Follicle(stiffness=(0.03, 0.03, 0.03), damping=(0.03, 0.03, 0.03))  # [C]


class _Whisker(NamedTuple):
    """A whisker, and where on the head it stands.

    Attributes
    ----------
    antenna
        It stands upright along y and bends towards x at rest.
    pose
        Its base as :class:`feeler.BaseMotion` takes it (6,): x, y, z [mm] and a rotation vector
        [rad]. The head looks along y, x is its right and z up; the origin lies amid the bases.
    """

    antenna: Antenna
    pose: np.ndarray


@checked
def rat_whiskers(
    side: Literal["left", "right"] = "right",
    *,
    n_segments: Annotated[int, "> 0"] = 20,
    follicle: Follicle | None = None,
) -> dict[str, _Whisker]:
    """The whiskers of one side by name, row by row from A0 to E6; column 0 is the hindmost.

    ``follicle`` holds each of them, such as :data:`feeler.antenna.rat.FOLLICLE`, which is a choice;
    by default their bases are clamped.
    """
    made = {row["name"]: _make(row, side == "left", n_segments) for row in _read_rows()}
    if follicle is None:
        return made
    return {
        name: _Whisker(antenna.replace(follicle=follicle), pose)
        for name, (antenna, pose) in made.items()
    }


@cache
def _read_rows() -> tuple[dict, ...]:
    text = files("feeler.antenna").joinpath("rat_whiskers.csv").read_text(encoding="utf-8")
    head, *lines = text.splitlines()
    rows = [
        dict(zip(head.split(","), map(float, line.split(",")), strict=True)) for line in lines
    ]
    names = [f"{'ABCDE'[int(row['row']) - 1]}{row['column']:.0f}" for row in rows]
    return tuple(row | {"name": name} for row, name in zip(rows, names, strict=True))


def _make(row: dict, left: bool, n_segments: int) -> _Whisker:
    length, k, column = row["length"], row["row"], row["column"]
    base = 0.5 * (0.041 + 0.002 * length + 0.011 * k - 0.0039 * column)
    slope = 0.0012 + 0.00017 * k - 0.000066 * column + 0.00011 * column**2
    tip = max(base - slope * length, _THINNEST)
    rest = np.zeros((2, n_segments))
    rest[0] = _bend(row["arc"], length, n_segments) * (-1 if left else 1)
    antenna = Antenna.from_beam(
        length=length,
        radius=lambda x: base + (tip - base) * x,
        modulus=_MODULUS,
        density=_DENSITY,
        n_segments=n_segments,
        damping_time=1.0,
        planes=2,
        rest_angle=rest,
        sensors=[1],
        name=f"rat {row['name']}",
    )
    share = _DAMPING_RATIO / compute_modes(antenna, 1).damping_ratio[0]
    return _Whisker(antenna.replace(damping=antenna.damping * share), _stand(row, left))


def _bend(arc: float, length: float, n: int) -> np.ndarray:
    """Angles (hinge,) [rad] of a chain whose segments are equal chords of the parabola A x²."""
    x = np.linspace(0.0, length, 2001)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), arc * np.diff(x**2)))])
    at = np.interp(length * np.arange(n + 1) / n, s, x)
    heading = np.arctan2(arc * np.diff(at**2), np.diff(at))
    return np.diff(heading, prepend=0.0)


def _stand(row: dict, left: bool) -> np.ndarray:
    """The pose of the base: about z, then y, then the whisker's own axis; left is the mirror."""
    theta, phi, zeta = row["theta"] - np.pi / 2, -row["phi"], row["zeta"] + np.pi / 2
    (c, s), (d, t), (e, u) = ((np.cos(a), np.sin(a)) for a in (theta, phi, zeta))
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_y = np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]])
    about_x = np.array([[1, 0, 0], [0, e, -u], [0, u, e]])
    along, across, up = (about_z @ about_y @ about_x).T
    frame = np.stack([-across, along, up], axis=1)  # its axes x, y, z on the head
    place = np.array([row["x"], row["y"], row["z"]])
    if left:  # mirrored; its own x is turned over, too, so that the frame stays right-handed
        image = np.array([-1.0, 1.0, 1.0])
        frame, place = image[:, None] * frame * image, image * place
    return np.concatenate([place, to_vector(frame)])
