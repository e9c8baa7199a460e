"""What smoke, quick, published and paper mean: every knob of a run, in one table. Nothing else
asks which scale it is.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Any

from feeler.objects.trials import LOCATIONS
from feeler.records import Ge, Gt, Record, Registry

if TYPE_CHECKING:
    from feeler.decoding.sweeps import Plan
    from feeler.encoding.model import ConvolutiveNMF

SCALES: Registry["Scale"] = Registry("scale")
_Count = Annotated[int, Ge(1)]
_Number = Annotated[int, Ge(0)]


class Scale(Record):
    """How much is computed. The defaults are paper scale; below it everything that is changed is
    said.

    Attributes
    ----------
    minutes : float
        How long a run takes on two cores, to be told at its start; measured by
        ``paper/measure.py``.
    vector : bool
        Whether figures are also drawn as PDF, which takes a tenth of a quick run.
    kept : tuple[str, ...]
        Stages that this scale does not compute: shown from the kept run at paper scale.
    queue : tuple[str, ...]
        Stages, longest first, so that no core waits at the end; but tensors, for which most others
        wait, early.
    controls : tuple[str, ...]
        Profiles beside the exponential one.
    fps : int
        Frames per second of every movie.
    fit_starts : int
        Perturbed starts from which every optimiser is run to its own convergence; 0 shows the kept
        comparison.
    control_starts : int
        Starts of the linear and of the uniform family.
    error_places : int
        Places of each error profile (odd).
    draws : int
        Bootstrap draws.
    refits : int
        Trust-region steps of the refit to each draw; 0 makes one linear step.
    wall_part : str
        Part of the family of set-ups that declared.toml declares; empty: all of it.
    drives : int | None
        How many profiles a wall comes nearer to without stopping; None: all.
    far_slides : int | None
        How many profiles a wall slides past at every distance; None: all.
    finished : int | None
        Of the restarts of other numbers of bases than three, those that go on past a third of the
        iterations, by their loss then; None: all.
    side_restarts : int
        Restarts of other durations (Fig. S5) and of the fits of other readings, for which the paper
        states none [C].
    control_restarts : int
        Restarts of fits to complete touches; of other readings than the main one as many starts are
        read.
    warn : bool
        Whether a fit that stops early says so; below paper scale it does so on purpose.
    sweep : Mapping[str, Any]
        What the noise sweeps change of ``feeler.decoding.sweeps.Plan``.
    network : Mapping[str, Any]
        Training of the network [C], which takes half a minute of one core each; several, since one
        is no sample; empty leaves the network out.
    trade_profiles : tuple[str, ...]
        Profiles whose speeds are compared; empty: the same as in the other sections.
    front : Mapping[str, Any]
        What the first page's study changes of ``[front]`` in declared.toml.
    questions : tuple[str, ...]
        Runs of studies/receptor/declared.toml that are computed; of the others cached results are
        shown.
    gaps : tuple[float, ...]
        Sizes of the reality gap.
    robots : int
        Surrogate robots of each size.
    variants : tuple[int, ...]
        Random models in training.
    shots : tuple[int, ...]
        Touches of the robot itself in training.
    robot_repeats : int
        Repeats in which the eight-segment model is compared; 0 leaves it out.
    """

    name: str
    minutes: Annotated[float, Gt(0)] = 45.0
    vector: bool = True
    kept: tuple[str, ...] = ()
    queue: tuple[str, ...] = (
        *(
            "tensors",
            "front",
            "tradeoff",
            "calibration",
            "reading",
            "cnn",
            "encoding",
            "receptor",
        ),
        *("gradient", "bounds", "unseen", "robot", "wall", "axes", "antenna", "design"),
        *("amplitude", "spikes", "space", "tracking"),
    )

    # what is touched
    controls: tuple[str, ...] = ("linear", "uniform", "matched")
    speeds: tuple[str, ...] = ("fast", "medium", "slow")
    control_speeds: tuple[str, ...] = ("fast", "medium", "slow")
    locations: tuple[float, ...] = LOCATIONS
    shapes: tuple[str, ...] = ("ball", "box", "triangle")
    fps: _Count = 25

    # calibration
    fit_starts: _Number = 3
    control_starts: _Number = 2
    error_places: _Number = 9
    draws: _Count = 100
    refits: _Number = 4

    # wall
    wall_part: str = ""
    drives: _Number | None = None
    far_slides: _Number | None = None

    # encoder
    ranks: tuple[_Count, ...] = (2, 3, 4, 5)  # [P]
    durations: tuple[_Count, ...] = (10, 20, 30, 40, 50, 60)  # samples of 1 ms [P]
    restarts: _Count = 10  # [P] Fig. 4B
    finished: _Count | None = None
    side_restarts: _Count = 2
    control_restarts: _Count = 3
    max_iter: _Count = 60
    tol: Annotated[float, Gt(0)] = 3e-4
    warn: bool = True

    # reading
    sweep: Mapping[str, Any] = field(
        default_factory=lambda: {
            "ratios": (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3),
            "n_repeats": 10,
            "other_repeats": 3,
            "before_copies": 3,
            "before_all": True,
        }
    )
    network: Mapping[str, Any] = field(
        default_factory=lambda: {
            "ratios": (0.1, 0.2, 0.3),
            "n_repeats": 3,
            "n_copies": 4,
            "max_epochs": 10,
        }
    )

    # questions beyond the paper: what these change of their declarations
    trade_profiles: tuple[str, ...] = ()
    trade: Mapping[str, Any] = field(default_factory=dict)
    gradient: Mapping[str, Any] = field(default_factory=dict)
    regression: Mapping[str, Any] = field(default_factory=dict)
    front: Mapping[str, Any] = field(default_factory=dict)
    questions: tuple[str, ...] = ("main",)

    # robot
    gaps: tuple[Annotated[float, Ge(0)], ...] = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)
    robots: _Count = 20
    variants: tuple[_Count, ...] = (1, 2, 5, 10)
    shots: tuple[_Number, ...] = (0, 1, 2, 4)
    shot_robots: _Number = 10
    robot_repeats: _Number = 10

    def __hash__(self) -> int:
        return hash(self.name)

    @property
    def plan(self) -> "Plan":
        """Ratios, repeats and copies of the noise sweeps."""
        from feeler.decoding.sweeps import Plan

        return Plan(**self.sweep)

    def make_encoder(self, **changes: Any) -> "ConvolutiveNMF":
        """An unfitted encoder with the paper's M = 3, T = 40 and sparseness 0.8; ``changes``
        override.
        """
        from paper.fig4 import CachedNMF

        settings = {
            "n_restarts": self.restarts,
            "max_iter": self.max_iter,
            "tol": self.tol,
            "warn": self.warn,
        }
        return CachedNMF(**(settings | {"random_state": 0, "n_jobs": -1} | changes))


_HEADLINE = {"relative": (1.0,), "common": (0.03,)}
"""Of the levels of noise those that the report shows."""
_BEYOND: dict[str, Any] = {
    "trade_profiles": ("exponential", "uniform"),
    "trade": {"sets": 1, "speeds": (0.3, 0.6, 1.2), "levels": _HEADLINE},
    "gradient": {
        "sets": 1,
        "draws": 20,
        "speeds": (0.6,),
        "rates": (0.0827, 0.0, -0.04, -0.0827),
    },
    "regression": {
        "shapes": ("ball",),
        "train": 60,
        "test": 4,
        "copies": 3,
        "relative": (0.1, 1.0),
        "common": (0.003, 0.03),
    },
    "front": {"sets": 2, "train": 3},
    "questions": (),
}
"""The questions beyond the paper below paper scale, where the kept run does not answer them: for
another antenna, engine or seed.
"""
_PAPER = Scale(name="paper")
_REST = (
    *(
        "front",
        "gradient",
        "axes",
        "bounds",
        "receptor",
        "unseen",
        "design",
        "antenna",
        "tracking",
    ),
    *("amplitude", "spikes", "space", "cnn"),
)
_PUBLISHED = _PAPER.replace(
    name="published",
    minutes=5.0,
    vector=False,
    kept=(
        "front",
        "cnn",
        "tradeoff",
        "gradient",
        "receptor",
        "amplitude",
        "bounds",
        "design",
        "unseen",
        "spikes",
    ),
    # the longest first; it makes the tensors while the wall, which needs none, is computed
    queue=(
        "reading",
        "wall",
        "tensors",
        "encoding",
        "robot",
        "calibration",
        "tradeoff",
        *_REST,
    ),
    controls=("linear", "uniform"),
    fit_starts=0,
    error_places=5,
    refits=0,
    draws=200,
    finished=3,
    side_restarts=1,
    max_iter=40,
    sweep={
        **_PAPER.sweep,
        "control_repeats": 3,
        "null_iter": 40,
        "other_copies": (),
        "before_repeats": 0,
        "twins": "ends",
    },
    network={},
    gaps=(0.0, 0.5, 1.0, 2.0, 3.0),
    shot_robots=5,
    **_BEYOND,
)
"""The default: every figure of the paper with its published sample sizes. Controls of our own have
fewer repeats, and what is kept is neither the paper's nor quick.
"""
QUICK = Scale(
    name="quick",
    minutes=1.0,
    vector=False,
    kept=_PUBLISHED.kept,
    controls=("linear", "uniform"),
    queue=(
        "tensors",
        "robot",
        "reading",
        "encoding",
        "wall",
        "tradeoff",
        "calibration",
        *_REST,
    ),
    control_speeds=("slow",),
    fps=8,
    fit_starts=0,
    control_starts=0,
    error_places=0,
    draws=200,
    refits=0,
    wall_part="quick",
    drives=3,
    far_slides=1,
    durations=(10, 40, 60),
    restarts=1,
    side_restarts=1,
    control_restarts=1,
    max_iter=20,
    tol=1e-3,
    warn=False,
    sweep={
        "ratios": (0.1, 0.3),
        "n_repeats": 2,
        "n_copies": 5,
        "other_copies": (),
        "before_repeats": 0,
        "null_restarts": 1,
        "null_iter": 20,
        "twins": "ends",
    },
    network={},
    **_BEYOND,
    gaps=(0.0, 1.0, 2.0),
    robots=1,
    variants=(),
    shots=(),
    shot_robots=0,
    robot_repeats=1,
)
_SMOKE = QUICK.replace(
    name="smoke",
    minutes=0.5,
    kept=(),
    controls=("uniform",),
    speeds=("fast", "slow"),
    locations=(LOCATIONS[0], LOCATIONS[-1]),
    shapes=("ball", "box"),
    fps=3,
    draws=50,
    wall_part="smoke",
    far_slides=0,
    drives=1,
    ranks=(2, 3),
    durations=(),
    max_iter=5,
    sweep={
        "ratios": (0.2,),
        "n_repeats": 1,
        "n_copies": 3,
        "other_copies": (),
        "before_repeats": 0,
        "null_restarts": 1,
        "null_iter": 5,
        "twins": "none",
    },
    trade={"sets": 1, "speeds": (0.6, 1.2), "draws": 5, "levels": _HEADLINE},
    gradient={
        "sets": 1,
        "draws": 5,
        "speeds": (0.6,),
        "rates": (0.0, -0.0827),
        "contact_control": False,
    },
    regression={
        "shapes": ("ball",),
        "train": 24,
        "test": 2,
        "relative": (1.0,),
        "common": (0.03,),
    },
    front={
        "sets": 2,
        "train": 2,
        "draws": 5,
        "absolute": [0.03],
        "relative": [0.3],
    },
    gaps=(1.0,),
    robot_repeats=0,
)
SCALES.register("smoke", _SMOKE)
SCALES.register("quick", QUICK)
SCALES.register("published", _PUBLISHED)
SCALES.register("paper", _PAPER)
