"""Tasks of active touch: what may be met, how it is felt, how the body may move, and what that
costs.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.special import log_softmax

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import cockroach
from feeler.antenna.sample import SampledAntennas
from feeler.errors import InvalidInput
from feeler.physics.contact import get_contact
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.physics.scene import Scene, make_scene
from feeler.records.record import Ge, Gt, Record, Unit
from feeler.records.rules import show
from feeler.stimulus.ninety import make_features
from feeler.stimulus.sample import SampledTrials
from feeler.task import Common, Nuisances, Task, parse_noise
from feeler.task.nuisances import is_number
from feeler.wall.course import Course

SAMPLE = 1.0  # ms; one step of the body, and one sample of every sensor


class Start(Record):
    """How one episode begins.

    Attributes
    ----------
    scene : Scene
        The antenna and what it may meet; nothing moves yet.
    direction : tuple[float, ...]
        Where the body goes when it goes ahead, in the world [unit vector], in space three numbers.
    target : float
        What is asked for, as it is now.
    course : Course | None
        The wall, where there is one.
    """

    scene: Scene
    direction: tuple[float, ...]
    target: float
    course: Course | None = None


class ActiveTask(Record, kw_only=False):
    """What all tasks share: an antenna on a body that moves by speed and turn, and is asked
    something all the while.

    Attributes
    ----------
    antenna : Antenna | SampledAntennas
        Or several, of which episodes draw.
    noise : Any
        On each sample of each sensor: a :class:`feeler.task.Noise`, text such as ``"common:0.03"``,
        or a number, the standard deviation in rad [C]. What a noise is relative to is a sample of
        all sensors.
    duration : float
        Length of an episode [ms].
    window : int
        Samples of every sensor that an observation shows, the last one last [C].
    max_speed : float
        Greatest speed of the body, ahead and back [mm/ms], [C].
    acceleration : float
        Greatest change of its speed in a millisecond [mm/ms per ms]; the first action sets the
        speed of arrival [C].
    max_turn : float
        Greatest turn rate [rad/ms]; 0.03 is 1700 °/s [C].
    time_cost : float
        Reward lost per millisecond [C].
    work_cost : float
        Reward lost per µJ of work on the antenna [C].
    timestep : float
        Of the integration [ms]: the coarsest that the contact allows [C].
    seed : int
        Of what may be met; episodes draw from it with a generator of their own.
    """

    antenna: Antenna | SampledAntennas = field(default_factory=cockroach)
    _: KW_ONLY
    noise: Any = "common:0.03"
    duration: Annotated[float, Gt(0), Unit("ms")] = 200.0
    window: Annotated[int, Gt(0)] = 5
    max_speed: Annotated[float, Gt(0), Unit("mm/ms")] = 1.2
    acceleration: Annotated[float, Gt(0), Unit("mm/ms²")] = 0.2
    max_turn: Annotated[float, Gt(0), Unit("rad/ms")] = 0.03
    time_cost: Annotated[float, Ge(0)] = 0.0
    work_cost: Annotated[float, Ge(0)] = 0.0
    timestep: Annotated[float, Gt(0), Unit("ms")] = 0.1
    engine: str = DEFAULT_ENGINE
    seed: int = 0

    n_outputs: ClassVar[int] = 1
    """How many numbers a prediction is."""

    def _check(self) -> None:
        noise = Common(self.noise) if is_number(self.noise) else parse_noise(self.noise)
        vars(self)["noise"] = noise

    @property
    def first_antenna(self) -> Antenna:
        """The antenna, or the one of which others were drawn."""
        return (
            self.antenna.antenna if isinstance(self.antenna, SampledAntennas) else self.antenna
        )

    def measure_noise(self, angle: np.ndarray) -> np.ndarray:
        """Standard deviation [rad] of the noise of samples (…, sensor), in their shape."""
        samples = angle.reshape(-1, angle.shape[-1], 1)
        return np.broadcast_to(self.noise.sd(samples), samples.shape).reshape(angle.shape)

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw an episode."""
        raise NotImplementedError

    def measure(self, start: Start, _base: np.ndarray) -> float:
        """What is asked for, with the base at x, y [mm] and heading [rad] (3,)."""
        return start.target

    def is_over(self, _target: float) -> bool:
        """Whether the episode has come to its end before its time."""
        return False

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Loss (lane,) of predictions (lane, output) of targets (lane,)."""
        raise NotImplementedError

    def charge(self, target: np.ndarray) -> np.ndarray:
        """What is lost (lane,) in a millisecond for where the body is, whatever it predicts."""
        return np.zeros(len(target))


class TouchTask(ActiveTask):
    """Which object is it? The body moves towards one of several, whose place, distance and
    direction it is not told.

    A prediction is a score for each object; the loss is the cross entropy of their softmax [nat],
    ln K for one who knows nothing.

    Attributes
    ----------
    features : Any
        Objects that may be met, equally likely: features, or text such as ``"ball:radius=2"``.
    sizes : Any
        Half-widths [mm], a spread; default: as large as the features are.
    locations : Any
        Where it meets the antenna, as a share of its length, a spread.
    gap : Any
        How far the object is at first [mm], a spread.
    approach : Any
        Angle of the motion to the antenna [degrees], a spread.
    friction : Any
        Coefficient of friction, a spread.
    azimuth : Any
        Of an antenna in space: by how much the approach is turned about the touched segment
        [degrees], a spread; the body goes that way.
    pool : int
        How many touches are drawn beforehand, of which episodes take one at random.
    """

    features: Any = field(default_factory=make_features)
    sizes: Any = None
    locations: Any = (0.5, 0.9)
    gap: Any = (2.0, 8.0)
    approach: Any = (86.0, 94.0)
    friction: Any = (0.6, 1.0)
    azimuth: Any = 0.0
    pool: Annotated[int, Gt(0)] = 2048

    def _check(self) -> None:
        super()._check()
        if not isinstance(self.features, Sequence) or isinstance(self.features, str):
            raise InvalidInput(
                f"features must be a list of objects, got {show(self.features)}."
            )
        if not self.features:
            raise InvalidInput(
                "there is nothing to touch: give features=, such as [Ball(radius=2), Box(...)]."
            )
        vars(self)["features"] = tuple(self.features)

    def to_plain(self) -> dict[str, Any]:
        """The task as plain data; an azimuth of 0 is left out, as in the plane there is none."""
        return {k: v for k, v in super().to_plain().items() if k != "azimuth" or v}

    @property
    def n_outputs(self) -> int:  # type: ignore[override]
        """One score for each object."""
        return len(self.features)

    @cached_property
    def trials(self) -> SampledTrials:
        """Every touch that may be met, at 1 mm/ms: their lead [ms] is the gap [mm]."""
        spreads = {
            "size": self.sizes,
            "location": self.locations,
            "approach": self.approach,
            "friction": self.friction,
            "azimuth": self.azimuth,
        }
        # for a task, a single number would be how far off the value may lie
        by = {
            name: (spread, spread) if is_number(spread) else spread
            for name, spread in spreads.items()
        }
        question = Task(
            objects=self.features,
            locations=(1.0,),
            speeds=(1.0,),
            nuisances=Nuisances(**by | {"size": by["size"] or 0.0}),
            noise=self.noise,
            lead=self.gap,
            deadline=self.duration,
        )
        return question.mix(self.pool, self.first_antenna, seed=self.seed)

    def begin(self, rng: np.random.Generator) -> Start:
        """Draw a touch: the object stands, and the body is to come."""
        return self.make_start(int(rng.integers(len(self.trials))))

    def make_start(self, index: int) -> Start:
        """The beginning of touch number ``index``."""
        antenna = self.antenna
        if isinstance(antenna, SampledAntennas):
            antenna = antenna[index % len(antenna)]
        contact = get_contact(None, self.first_antenna)  # one timestep for all
        scene = make_scene(antenna, self.trials[index], contact)
        velocity = scene.objects[0].velocity
        stopped = scene.objects[0].replace(velocity=(0.0,) * len(velocity))
        return Start(
            scene=replace(scene, objects=(stopped,)),
            direction=tuple(-v for v in velocity),
            target=self.get_target(index),
        )

    def get_target(self, index: int) -> float:
        """Number of the object of touch ``index``."""
        return float(self.trials.columns["feature"][index])

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Cross entropy (lane,) [nat]."""
        scores = log_softmax(prediction, axis=1)
        return -scores[np.arange(len(target)), target.astype(int)]


class LocaliseTask(TouchTask):
    """Where on the antenna is it? The loss is the squared error over the variance of what may be
    met, 1 for one who knows nothing but that."""

    @property
    def n_outputs(self) -> int:  # type: ignore[override]
        """A place."""
        return 1

    def get_target(self, index: int) -> float:
        """Where touch ``index`` begins, as a share of the antenna's length."""
        return float(self.trials.columns["location"][index])

    def compute_loss(self, prediction: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Squared error (lane,), relative."""
        variance = max(float(np.var(self.trials.columns["location"])), 1e-12)
        return (prediction[:, 0] - target) ** 2 / variance
