"""Bits that a stated decoder gets of held-out touches, their error, and the fewest sensors that
give them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from sklearn.base import clone

from feeler.antenna.segments import Antenna, make_even_sensors
from feeler.decoding import CLASSIFIERS, Classifier
from feeler.decoding.observers import fit_class
from feeler.decoding.sweeps import N_COPIES
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.execute.workers import hold_blas
from feeler.objects.bodies import Object, make_object
from feeler.objects.noise import Common
from feeler.objects.task import Nuisances, Task
from feeler.objects.trials import LEAD, Trial
from feeler.physics.contact import get_contact
from feeler.physics.run import expect_motions
from feeler.physics.run import simulate as run_scenes
from feeler.physics.scene import Clock, Scene
from feeler.records import Ge, Gt, Registry, Shown, Unit
from feeler.renamed import rename_arguments
from feeler.validation import Count, checked

# What a designed antenna is to discriminate: a task with touches to learn from and to ask about.


class DesignTask(Task):
    """A :class:`feeler.objects.Task`, and how many touches of each class are trained and tested.

    Attributes
    ----------
    train : int
        Touches of each class that the decoder learns from.
    test : int
        Other touches of each class that it is asked about.
    unseen : Nuisances | None
        How those differ, if not as the touches that are learned from do: for example of sizes and
        at places that those never had.
    timestep : float
        Integration step [ms].
    seeds : Any
        Of the touches for the optimiser, for tests, and for the final judgement that is looked at
        once.

    Raises
    ------
    InvalidInput
        Fewer than two classes, or a field outside its range.
    """

    train: Annotated[int, Ge(2)] = 4
    test: Annotated[int, Ge(1)] = 4
    unseen: Nuisances | None = None
    timestep: Annotated[float, Gt(0), Unit("ms")] = 0.05
    seeds: Any = (("optimiser", 1), ("test", 2), ("final", 3))

    def _check(self) -> None:
        super()._check()
        if not self.noise.size > 0:
            raise InvalidInput(
                "the noise of a design's task must be > 0: without it all is told."
            )
        if self.n_classes < 2:
            raise InvalidInput(
                "a design's task needs at least two classes (objects × locations): with one there"
                " is nothing to discriminate."
            )
        if missing := {"optimiser", "test", "final"} - dict(self.seeds).keys():
            raise InvalidInput(
                f"seeds must name optimiser, test and final; {min(missing)} lacks."
            )

    def draw_classes(self, antenna: Antenna, purpose: str, speed: float) -> list[Trial]:
        """The touches for one purpose, class by class, ``train`` before ``test`` ones."""
        each = self.train + self.test
        met, _ = self.draw(antenna, purpose, speed=speed, each=each)
        if self.unseen is None:
            return met
        new, _ = self.replace(nuisances=self.unseen, unseen=None).draw(
            antenna, purpose, speed=speed, each=each
        )
        return [met[k] if k % each < self.train else new[k] for k in range(len(met))]


# Score: bits that a stated decoder gets of held-out touches; smooth in the antenna,
# with its standard error.
#
# The decoder learns from clean touches. It takes the tensors of class k in noise for normal,
# with the mean m_k of the class's touches and the covariance Σ_k = σ² 1 + B_kᵀ B_k: white noise
# of known sd σ, and the scatter B_k of the touches about their mean, which is what the
# nuisances do. With u = y − m_k and S_k = σ² 1 + B_k B_kᵀ (small), its logits are
#
#     −½ (|u|² − uᵀ B_kᵀ S_k⁻¹ B_k u) / σ² − ½ ln det S_k.
#
# Asked about other touches in noise, its posterior p(k|y) gives
#
#     bits = log₂ K + ⟨log₂ p(true | y)⟩,
#
# a lower bound on the mutual information of class and tensor, as any decoder's cross-entropy is
# (Barber & Agakov 2003). The same noise is drawn for all antennas, in pairs n, −n, so that the
# score is a smooth function of the tensors, and its derivative is exact for the noise that was
# drawn. The share of errors, a staircase, is only reported.

N_DRAWS = 32  # [C] pairs of drawn noise
_NOISE_SEED = 0


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Score(Shown):
    """How well held-out touches are discriminated, means over the speeds.

    Attributes
    ----------
    bits : float
        Lower bound on the mutual information of class and tensor [bit], at most log₂ K; below 0
        where the decoder misleads.
    bits_error : float
        Its standard error, from how the test touches differ.
    errors : float
        Share of noisy test touches classified incorrectly.
    errors_error : float
        Its standard error.
    peak : float
        Greatest hinge angle of all touches at the sensors [rad].
    by_speed : np.ndarray
        Bits and errors (speed, 2).
    confusion : np.ndarray
        Shares (class, answer), rows sum to 1.
    wrong : np.ndarray
        Share classified incorrectly of each test touch (speed, class, touch): pairs for
        comparing antennas.
    """

    bits: float
    bits_error: float
    errors: float
    errors_error: float
    peak: float
    by_speed: Annotated[np.ndarray, "speed 2"]
    confusion: Annotated[np.ndarray, "true answer"]
    wrong: Annotated[np.ndarray, "speed class touch"]


@rename_arguments(reader="classifier")
@checked
def score(
    antenna: Antenna,
    task: DesignTask,
    purpose: str = "test",
    *,
    classifier: str | Classifier | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
) -> Score:
    """How well the decoder tells the task's classes apart by this antenna.

    Parameters
    ----------
    purpose
        Which draws of touches: ``optimiser``, ``test`` or ``final``.
    classifier
        Another decoder, or its name; see :data:`feeler.decoding.CLASSIFIERS`. Unless it is told the
        noise, it learns noisy copies of the touches.
    workers, executor
        As for :func:`feeler.touch`.

    Raises
    ------
    SimulationDivergedError
        Some touch left the finite numbers.
    """
    return judge(
        [
            _touch_classes(antenna, task, purpose, v, workers=workers, executor=executor)
            for v in task.speeds
        ],
        task,
        classifier,
    )


def _touch_classes(
    antenna: Antenna,
    task: DesignTask,
    purpose: str,
    speed: float,
    **options: Any,
) -> np.ndarray:
    """Angles (class, touch, sensor, time) since contact; what :func:`feeler.touch` gives of the
    same trials, in space as :func:`feeler.tensors.transforms.stack_planes` puts its planes.
    """
    # The scene of every touch; where objects stand depends on the antenna's outline alone,
    # and is kept.
    even = np.ones_like(antenna.stiffness)
    outline = antenna.replace(stiffness=even, damping=even, sensors=[1], name="")
    contact = get_contact(None, antenna)
    objects = _place_objects(outline, task.replace(noise=Common(1.0)), purpose, speed)
    scenes = [
        Scene(antenna=antenna, objects=(item,), contact=contact, label=item.name)
        for item in objects
    ]
    clock = Clock(
        duration=task.duration, timestep=scenes[0].contact.scale_timestep(task.timestep)
    )
    motions = expect_motions(run_scenes(scenes, clock, **options))
    angles = np.array(
        [motion.angle[round(LEAD) + 1 :, ..., antenna.sensors - 1] for motion in motions]
    )
    each, rows = task.train + task.test, len(antenna.planes) * antenna.sensors.size
    folded = angles.reshape(len(motions), -1, rows).swapaxes(1, 2)
    return folded.reshape(task.n_classes, each, *folded.shape[1:])


@lru_cache(maxsize=32)
def _place_objects(
    outline: Antenna, task: DesignTask, purpose: str, speed: float
) -> tuple[Object, ...]:
    return tuple(
        make_object(outline, trial) for trial in task.draw_classes(outline, purpose, speed)
    )


def judge(
    angles: list[np.ndarray], task: DesignTask, classifier: str | Classifier | None = None
) -> Score:
    """The score of angles (class, touch, sensor, time), speed by speed."""
    classifier = CLASSIFIERS[classifier]() if isinstance(classifier, str) else classifier
    with hold_blas():
        found = [
            _decode_angles(one, task)
            if classifier is None
            else _read_angles(one, task, classifier)
            for one in angles
        ]
    bits = np.array([logs.mean(axis=0) for logs, _ in found])  # (speed, class, touch)
    answers = np.array([shares for _, shares in found])  # (speed, class, touch, answer)
    k = np.arange(task.n_classes)
    wrong = 1.0 - answers[:, k, :, k].transpose(1, 0, 2)
    return Score(
        bits=float(bits.mean()),
        bits_error=estimate_error(bits),
        errors=float(wrong.mean()),
        errors_error=estimate_error(wrong),
        peak=float(max(np.abs(one).max() for one in angles)),
        by_speed=np.stack([bits.mean(axis=(1, 2)), wrong.mean(axis=(1, 2))], axis=1),
        confusion=answers.mean(axis=(0, 2)),
        wrong=wrong,
    )


def _decode_angles(angles: np.ndarray, task: DesignTask) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`decode` gives of the angles in whose unit the noise is white.

    Noise that is white in no unit is drawn as it is, for a decoder that is told its sd.
    """
    flat = angles.reshape(-1, *angles.shape[2:])
    if not task.noise.is_even(flat):
        return _read_angles(angles, task, CLASSIFIERS["templates"]())
    white = task.noise.whiten(flat).reshape(*angles.shape[:2], -1)
    return decode(white, task.train, task.noise.size)


def _read_angles(
    angles: np.ndarray, task: DesignTask, classifier: Classifier
) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`decode` gives, by another classifier."""
    rng, model = np.random.default_rng(_NOISE_SEED), clone(classifier)
    known, tests = (
        part.reshape(-1, *angles.shape[2:]) for part in np.split(angles, [task.train], axis=1)
    )
    labels = np.repeat(np.arange(task.n_classes), task.train)
    if model.knows_noise:
        model.set_params(noise=task.noise).fit(known, labels)
    else:
        model.fit(task.noise.add(known, rng, N_COPIES), np.tile(labels, N_COPIES))
    noisy = (task.noise.add(tests, rng) for _ in range(2 * N_DRAWS))
    chance = np.array([np.asarray(model.predict_proba(one)) for one in noisy])
    # who notices no contact guesses
    chance = np.nan_to_num(chance, nan=1 / task.n_classes)
    logits = np.log(np.maximum(chance, np.finfo(float).tiny))
    return _count_bits(logits.reshape(2 * N_DRAWS, task.n_classes, task.test, -1))


@checked
def decode(
    tensors: Annotated[np.ndarray, "class touch entry"],
    train: Count,
    sd: Annotated[float, Gt(0)],
) -> tuple[np.ndarray, np.ndarray]:
    """Bits (noise, class, touch) of each test touch in each drawn noise, and its answers' shares
    (class, touch, answer).
    """
    return _count_bits(_compute_logits(tensors[:, :train], tensors[:, train:], sd))


def _count_bits(logits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`decode` gives, from logits (noise, class, touch, answer)."""
    count = logits.shape[-1]
    answers = np.eye(count)[logits.argmax(axis=-1)].mean(axis=0)
    shifted = logits - logits.max(axis=-1, keepdims=True)
    shifted -= np.log(np.exp(shifted).sum(axis=-1, keepdims=True))
    k = np.arange(count)
    own = shifted[:, k, :, k].transpose(1, 0, 2)
    return np.log2(count) + own / np.log(2), answers


def _compute_logits(known: np.ndarray, tests: np.ndarray, sd: float) -> np.ndarray:
    """Logits (noise, class, touch, answer) of noisy test touches, less what all answers share.

    The noise is the same for all antennas, in pairs n, −n.
    """
    units = _draw_units(tests.shape[-1])
    noise = np.concatenate([sd * units, -sd * units])
    cross = np.einsum("ne,kte->nkt", noise, tests)
    logits = np.empty((*cross.shape, len(known)))
    for k, own in enumerate(known):
        mean, scatter, inverse, logdet = fit_class(own, sd)
        far = tests - mean
        square = np.einsum("kte,kte->kt", far, far) + 2 * (
            cross - (noise @ mean)[:, None, None]
        )
        seen = (noise @ scatter.T)[
            :, None, None
        ] + far @ scatter.T  # (noise, class, touch, row)
        within = np.einsum("nktr,rs,nkts->nkt", seen, inverse, seen, optimize=True)
        logits[..., k] = -0.5 * (square - within) / sd**2 - 0.5 * logdet
    return logits


@lru_cache(maxsize=4)
def _draw_units(entries: int) -> np.ndarray:
    return np.random.default_rng(_NOISE_SEED).standard_normal((N_DRAWS, entries))


def estimate_error(values: np.ndarray) -> float:
    """Standard error of the mean of values (speed, class, touch): touches are resampled, classes
    and speeds are given.
    """
    count = values.shape[2]
    if count < 2:
        return float("nan")
    spread = values.mean(axis=0).var(axis=1, ddof=1)  # the same draws meet all speeds
    return float(np.sqrt(spread.sum() / count) / values.shape[1])


# Sensors: which few hinges tell nearly as much as all of them, by what rule they are chosen,
# and what each set tells.

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
    count: Count,
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
    angles = _touch_classes(antenna, task, purpose, task.speeds[0])
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
