"""Sensors: which few hinges tell nearly as much as all of them, by what rule they are chosen, and
what each set tells.
"""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna, make_even_sensors
from feeler.design.scoring import decode, touch_classes
from feeler.design.task import DesignTask
from feeler.errors import InvalidInput, MissingExtra
from feeler.execute.threads import hold_blas
from feeler.records.checked import checked
from feeler.records.registry import Registry

_Choice = Callable[[np.ndarray, float, int], np.ndarray]
"""``choice(tensors, sd, count)``: numbers of sensors of tensors (class, touch, sensor, time), best
first, at least ``count``.
"""
CHOICES: Registry[_Choice] = Registry("choice of sensors")
"""Every known rule by its name."""


@checked
def choose_sensors(
    antenna: Antenna,
    task: DesignTask,
    count: Annotated[int, "> 0"],
    choice: str = "d-optimal",
    purpose: str = "optimiser",
) -> np.ndarray:
    """The hinge numbers (count,) of the antenna's sensors that a rule of :data:`CHOICES` takes
    first, rising.

    Noise that is relative is a share of the peak over all of the antenna's sensors, whichever are
    kept.
    """
    if count > antenna.sensors.size:
        raise InvalidInput(
            f"count must be at most the antenna's {antenna.sensors.size} sensors, got {count}."
        )
    known = _feel(antenna, task, purpose)
    return np.sort(antenna.sensors[CHOICES[choice](known, task.noise.size, count)[:count]])


@checked
def measure_sensors(
    antenna: Antenna,
    task: DesignTask,
    counts: list[int],
    choice: str = "d-optimal",
    purpose: str = "test",
) -> np.ndarray:
    """Bits (count,) that sets of so many sensors tell; chosen on the optimiser's draws, asked on
    those of ``purpose``.
    """
    known, asked = (_feel(antenna, task, name) for name in ("optimiser", purpose))
    chosen = [
        np.sort(CHOICES[choice](known, task.noise.size, n)[:n]) for n in counts
    ]  # in their order along the antenna
    return np.array([_tell(asked[:, :, own], task, len(antenna.planes)) for own in chosen])


def _tell(felt: np.ndarray, task: DesignTask, planes: int) -> float:
    """Bits of what sensors feel, put plane by plane, as the score meets the same noise."""
    tensors = felt.reshape(*felt.shape[:3], planes, -1).swapaxes(2, 3)
    with hold_blas():
        return float(
            decode(tensors.reshape(*tensors.shape[:2], -1), task.train, task.noise.size)[
                0
            ].mean()
        )


def _feel(antenna: Antenna, task: DesignTask, purpose: str) -> np.ndarray:
    """The angles (class, touch, sensor, time) in whose unit the noise is white, of each sensor one
    plane after the other; noise that is not even is taken for white.
    """
    angles = touch_classes(antenna, task, purpose, task.speeds[0])
    flat = task.noise.whiten(angles.reshape(-1, *angles.shape[2:]))
    each, count = angles.shape[:2], antenna.sensors.size
    planes = flat.reshape(*each, len(antenna.planes), count, angles.shape[3])
    return planes.swapaxes(2, 3).reshape(*each, count, -1)


@CHOICES.register("d-optimal")
def _choose_greedily(tensors: np.ndarray, sd: float, count: int) -> np.ndarray:
    """One after the other, each that adds most to ln det(1 + Σ_s M_s M_sᵀ / σ²): twice the
    information [nat] that a normal source with these class means would pass through them (Krause et
    al. 2008 bound how far greed can be off).
    """
    means = tensors.mean(axis=1)
    means = means - means.mean(axis=0)
    each = np.einsum("kst,jst->skj", means, means) / sd**2
    order: list[int] = []
    total = np.eye(len(means))
    for _ in range(count):
        gain = np.linalg.slogdet(total + each)[1]
        gain[order] = -np.inf
        order.append(int(gain.argmax()))
        total = total + each[order[-1]]
    return np.array(order)


@CHOICES.register("even")
def _choose_evenly(tensors: np.ndarray, _sd: float, count: int) -> np.ndarray:
    return make_even_sensors(tensors.shape[2], count) - 1


@CHOICES.register("random")
def _choose_by_chance(tensors: np.ndarray, _sd: float, _count: int) -> np.ndarray:
    return np.random.default_rng(0).permutation(tensors.shape[2])


@CHOICES.register("sspoc")
def _choose_sparsely(tensors: np.ndarray, _sd: float, count: int) -> np.ndarray:
    """PySensors' sparse sensor placement for classification (Brunton et al. 2016): each sensor's
    time course in one vector, whose greatest absolute value counts for the sensor."""
    try:
        from pysensors.classification import SSPOC
    except ImportError as error:
        raise MissingExtra(
            "sparse placement needs PySensors: pip install 'feeler[design]'."
        ) from error
    peaks = np.take_along_axis(tensors, np.abs(tensors).argmax(axis=-1)[..., None], axis=-1)[
        ..., 0
    ]
    flat, labels = (
        peaks.reshape(-1, tensors.shape[2]),
        np.repeat(np.arange(len(tensors)), tensors.shape[1]),
    )
    model = SSPOC(n_sensors=count).fit(flat, labels, quiet=True)
    return np.asarray(model.get_selected_sensors())
