"""A touch, sent piece by piece while it is simulated: the same bits as ``feeler.touch``."""

import hashlib
from collections.abc import Iterator
from functools import lru_cache
from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.modes import compute_modes
from feeler.physics.lanes import Simulations
from feeler.physics.simulation import build_scene
from feeler.stimulus.convex import trace_rim
from feeler.stimulus.feature import Feature
from feeler.stimulus.trial import Trial
from feeler.studio.wish import PREVIEW, TouchWish

SAMPLE_INTERVAL = 1.0  # ms between samples
_FIRST, _PIECE = (
    12,
    46,
)  # samples; the first is short, so that something is seen at once; each costs 2 ms on its way
_REACH = 400.0  # mm; faces without end are drawn as far as this


class Readings:
    """What a page is shown of a simulation of one lane, sample by sample."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, ...]] = []

    def add(self, simulation: Simulations) -> None:
        """Take one sample.

        Raises
        ------
        SimulationDiverged
            There is nothing to read any more.
        """
        if simulation.failed[0] is not None:
            raise simulation.failed[0]
        state = simulation.state
        shown = (
            state.angle,
            state.place,
            state.forward,
            state.force,
            state.base,
            state.contact_place,
            state.base_moment,
        )
        self.rows.append(tuple(values[0] for values in shown))

    @property
    def angle(self) -> np.ndarray:
        """Angles (segment,) [rad] of the last sample."""
        return self.rows[-1][0]

    def take(self) -> dict[str, np.ndarray]:
        """All that came since the last call: arrays (sample, …)."""
        angle, place, forward, force, base, contact, moment = (
            np.array(column) for column in zip(*self.rows, strict=True)
        )
        self.rows = []
        turn = np.arctan2(forward[:, :, 0], forward[:, :, 1])
        place = np.concatenate([place, turn[:, :, None]], axis=2)
        return {
            "angle": angle,
            "place": place,
            "force": force,
            "base": base,
            "contact": contact,
            "moment": moment,
        }


def make_simulation(wish: TouchWish) -> Simulations:
    """The simulation of a wish at time 0."""
    scene = build_scene(wish.antenna.make(), wish.make_objects())
    timestep = scene.contact.scale_timestep(PREVIEW) if wish.preview else None
    return Simulations([scene], timestep=timestep)


def simulate_pieces(
    wish: TouchWish, stop: Event
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Number of the first sample and readings of each piece; ends early when ``stop`` is set."""
    simulation, readings, n_samples = make_simulation(wish), Readings(), count_samples(wish)
    done, size = 0, _FIRST
    for k in range(n_samples):
        if stop.is_set():
            return
        if k:
            simulation.step(SAMPLE_INTERVAL)
        readings.add(simulation)
        if len(readings.rows) == size or k == n_samples - 1:
            yield done, readings.take()
            done, size = k + 1, _PIECE


def count_samples(wish: TouchWish) -> int:
    """Samples of a whole touch."""
    return round(wish.duration / SAMPLE_INTERVAL)


def describe_antenna(antenna: Antenna) -> dict[str, Any]:
    """What a page needs to draw an antenna and to label its tensor; in space profiles are those of
    bending towards x.
    """
    profiles = {
        "stiffness": antenna.stiffness,
        "damping": antenna.damping,
        "rest": antenna.rest_angle,
    }
    own = {"planes": list(antenna.planes)} if antenna.spatial else {}
    return own | {
        "name": antenna.name,
        "length": antenna.length,
        "segments": antenna.segment_length.tolist(),
        "radius": float(antenna.radius.mean()),
        "sensors": antenna.sensors.tolist(),
        **{name: np.atleast_2d(rows)[0].tolist() for name, rows in profiles.items()},
    }


@lru_cache(maxsize=64)
def describe_mode(antenna: Antenna) -> dict[str, float | None]:
    """Damped frequency [kHz] and damping ratio of the first mode; no frequency where it does not
    swing.
    """
    modes = compute_modes(antenna, 1)
    ratio = float(modes.damping_ratio[0])
    swings = ratio < 1 and modes.frequency[0] > 0
    return {
        "frequency": float(modes.frequency[0] * np.sqrt(1 - ratio**2)) if swings else None,
        "damping_ratio": ratio if np.isfinite(ratio) else None,
    }


def describe_scene(wish: TouchWish) -> dict[str, Any]:
    """What a page needs to draw a touch: the antenna, and each object's outlines."""
    features = [
        item.shape if isinstance(item, Trial) else item.feature for item in wish.make_objects()
    ]
    rims = [draw_feature(feature) for feature in features]
    return {
        "antenna": describe_antenna(wish.antenna.make()),
        "rims": rims,
        "preview": wish.preview,
    }


def draw_feature(feature: Feature) -> list[list[list[float]]]:
    """Outlines (point, 2) [mm] of a feature's parts in its own frame: first axis forwards, second
    to the left.
    """
    rims = (trace_rim(part, feature.rounding) for part in feature.parts)
    return [np.clip(rim, -_REACH, _REACH).round(4).tolist() for rim in rims]


def hash_tensor(tensor: np.ndarray) -> str:
    """SHA-256 of a tensor (sensor, time) as float32."""
    return hashlib.sha256(np.ascontiguousarray(tensor, dtype="<f4").tobytes()).hexdigest()
