"""The error that every touch is given by default, held against a tenth of the timestep."""

import re
import warnings
from itertools import pairwise

import numpy as np
import pytest

import feeler
from feeler.errors import AccuracyWarning, InvalidInput
from feeler.objects import Feature
from feeler.objects import trials as ninety
from feeler.physics import run as accuracy
from feeler.physics.contact import get_contact
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Motion, make_scene

ENGINE = "chain-consistent"
# off by 9 to 28 % of the peak at the default timestep, and nothing else is wrong with them
OFF = (1069, 1306, 1365, 1762, 1779, 1934, 2213, 2233, 2420, 2481)


def draw_antenna(rng: np.random.Generator) -> feeler.Antenna:
    """8 to 40 segments, 15 to 60 mm, up to 6 e-folds of stiffness, damping times 0.1 to 20 ms."""
    n, size = int(rng.integers(8, 41)), np.exp(rng.uniform(np.log(15), np.log(60)))
    along = np.linspace(0, 1, n)
    length = np.linspace(1, rng.uniform(0.3, 1.2), n)
    length *= size / length.sum()
    thick = rng.uniform(0.1, 0.35)
    radius = thick + (thick * rng.uniform(0.2, 1.0) - thick) * along
    stiffness = np.exp(rng.uniform(np.log(0.3), np.log(50))) * np.exp(
        -rng.uniform(0, 6) * along
    )
    time = np.exp(rng.uniform(np.log(0.1), np.log(20)))
    return feeler.Antenna(
        segment_length=length,
        segment_mass=1.1e-3 * np.pi * radius**2 * length,
        radius=radius,
        stiffness=stiffness,
        damping=stiffness * time * np.exp(rng.uniform(-1, 1) * along),
    )


def draw_feature(rng: np.random.Generator) -> Feature:
    kind = rng.choice(["ball", "box", "triangle", "peg"])
    size = float(np.exp(rng.uniform(np.log(0.4), np.log(3))))
    if kind == "box":
        return feeler.Box(half_width=size, half_height=size * float(rng.uniform(0.5, 2)))
    if kind == "triangle":
        return feeler.Triangle(half_width=size)
    return feeler.Ball(radius=size if kind == "ball" else float(rng.uniform(0.1, 0.5)))


def draw(seed: int) -> tuple[feeler.Antenna, feeler.Trial]:
    """A sensible antenna and a sensible touch of it; some bases move."""
    rng = np.random.default_rng(seed)
    while True:
        antenna, feature, base = draw_antenna(rng), draw_feature(rng), None
        if rng.random() < 0.3:
            x, y = rng.uniform(-0.05, 0.05, 2)
            base = feeler.BaseMotion(
                velocity=(float(x), float(y)), turn=float(rng.uniform(-0.002, 0.002))
            )
        try:
            trial = feeler.Trial(
                feature=feature,
                location=float(rng.uniform(0.4, 1.0)),
                speed=float(np.exp(rng.uniform(np.log(0.03), np.log(2)))),
                approach=float(rng.uniform(60, 120)),
                side=str(rng.choice(["left", "right"])),
                friction=float(rng.uniform(0, 1)),
                base=base,
            )
            make_scene(antenna, trial)
        except InvalidInput:  # it would begin inside the antenna
            continue
        return antenna, trial


def measure(seed: int, contact: str = "smooth", timestep: float = 0.05) -> tuple[Motion, float]:
    """The touch with its estimated error, and the true one."""
    antenna, trial = draw(seed)
    scene = make_scene(antenna, trial, get_contact(contact, antenna))
    step = scene.contact.scale_timestep(timestep)
    clock, fine = (Clock(duration=380.0, timestep=h) for h in (step, step / 10))
    motion = accuracy.run_with_error([scene], clock, ENGINE)[0]
    truth = run_scene(scene, fine, ENGINE).angle
    return motion, float(np.abs(motion.angle - truth).max() / np.abs(truth).max())


@pytest.mark.parametrize("seed", OFF)
def test_what_is_off_says_so(seed):
    motion, error = measure(seed, "smooth:0.2")
    assert error > 0.09
    assert motion.error > 0.05


@pytest.mark.parametrize(
    "seeds", [range(4), pytest.param(range(3000, 3200), marks=pytest.mark.long)]
)
def test_of_random_touches_those_that_are_off_are_named_and_few_others(seeds):
    found = [measure(seed) for seed in seeds]
    named = np.array([motion.error > 0.05 for motion, _ in found])
    errors = np.array([error for _, error in found])
    assert (named | (errors <= 0.055)).mean() > 0.99
    assert (named & (errors < 0.05)).mean() < 0.12
    assert (named & (errors < 0.01)).sum() == 0


def test_the_error_halves_with_the_timestep():
    scene = make_scene(feeler.presets.cockroach(), make_trial())
    errors = [
        accuracy.run_with_error([scene], Clock(duration=100.0, timestep=h), ENGINE)[0].error
        for h in (0.05, 0.025, 0.0125)
    ]
    for coarse, fine in pairwise(errors):
        assert 1.6 < coarse / fine < 2.4


def make_trial(**changes: object) -> feeler.Trial:
    given = {"feature": feeler.Ball(radius=1.5), "location": 0.7, "speed": 0.3} | changes
    return feeler.Trial(**given)


@pytest.mark.further
@pytest.mark.parametrize("save", [None, ("angle",), ("angle", "error")])
def test_it_stands_beside_the_tensors_and_in_a_store(save, tmp_path):
    antenna, trials = feeler.presets.cockroach(), [make_trial(), make_trial(speed=0.6)]
    own = feeler.touch(antenna, trials, duration=60, save=save)
    kept = feeler.touch(antenna, trials, duration=60, save=save, store=tmp_path / "store")
    assert own["error"].dims == ("trial",)
    assert np.all((own["error"] > 0) & (own["error"] < 0.05))
    np.testing.assert_array_equal(kept["error"], own["error"])
    angles = [
        run_scene(make_scene(antenna, t), Clock(duration=60, timestep=0.05)) for t in trials
    ]
    sensors = antenna.sensors - 1
    for k, motion in enumerate(angles):  # the estimate leaves the tensors as they are
        assert np.array_equal(own["angle"].values[k], motion.angle[:, sensors].T)


def test_a_warning_names_each_touch_that_may_be_off():
    antenna, trial = draw(1365)
    with pytest.warns(AccuracyWarning, match="smaller timestep=") as warned:
        slow = trial.replace(speed=0.03, location=0.9)
        tensors = feeler.touch(antenna, [slow, trial], contact="smooth:0.2")
    assert re.search(
        r"are 1 of 2 at timestep 0.05 ms, off by more than 5% of their peak: 1: ball at 0\.\d+ L,"
        r" 0\.893 m/s, 0\.\d+ of the peak\.",
        warned[0].message.details,
    )
    assert (tensors["error"] > 0.05).values.tolist() == [False, True]
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        feeler.touch(antenna, trial, timestep=1e-3)


@pytest.mark.parametrize(
    ("timestep", "sample_interval"),
    [(0.1, 1.0), (0.08, 0.4), (0.05, 0.05), (0.05, 0.15), (0.05, 7.0), (0.05, 90.0)],
)
def test_every_clock_has_an_error(timestep, sample_interval):
    """Coarser than that the contact allows no timestep; an odd number of steps has no half."""
    antenna, trial = draw(1365)
    clocks = {"duration": 100.0, "sample_interval": sample_interval, "contact": "smooth:0.2"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        own = feeler.touch(antenna, trial, timestep=timestep, all_hinges=True, **clocks)
        fine = feeler.touch(antenna, trial, timestep=timestep / 10, all_hinges=True, **clocks)
    gap = np.abs(own["angle"] - fine["angle"]).max() / np.abs(fine["angle"]).max()
    assert float(own["error"][0]) > 0.6 * float(gap) > 0


@pytest.mark.long
@pytest.mark.parametrize("engine", ["chain", "mujoco"])
def test_every_engine_has_one(engine):
    antenna = feeler.presets.cockroach()
    own = feeler.touch(antenna, make_trial(speed=0.1), duration=30, engine=engine)
    assert 0 < float(own["error"][0]) < 0.05


def test_what_touches_nothing_errs_by_nothing():
    tensors = feeler.touch(feeler.presets.cockroach(), make_trial(lead=50.0), duration=20)
    assert float(tensors["error"][0]) == 0.0


@pytest.mark.long
def test_touches_of_the_paper_take_less_than_half_as_many_steps_again(monkeypatch):
    steps, real = [], accuracy.run_group

    def count(scenes, clock, *options):
        steps.append(len(scenes) * (clock.n_samples - 1) * clock.steps_per_sample)
        return real(scenes, clock, *options)

    monkeypatch.setattr(accuracy, "run_group", count)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        feeler.touch(feeler.presets.cockroach(), ninety.trials(), workers=1)
    whole = 90 * 379 * 20
    assert whole < sum(steps) < 1.45 * whole


@pytest.mark.parametrize("seed", [1001, pytest.param(1113, marks=pytest.mark.long)])
def test_an_accuracy_out_of_reach_gives_nothing_worse_than_the_default(seed):
    antenna, trial = draw(seed)
    with pytest.warns(AccuracyWarning, match="did not reach the accuracy") as warned:
        asked = feeler.touch(antenna, trial, accuracy=0.01, all_hinges=True)
    assert "accuracy=0.01: 0: " in warned[0].message.details
    assert np.isinf(asked["error"]).all()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        default, fine = (
            feeler.touch(antenna, trial, timestep=h, all_hinges=True)["angle"]
            for h in (0.05, 0.001)
        )
    gaps = [float(np.abs(each - fine).max()) for each in (asked["angle"], default)]
    assert gaps[0] < 0.2 * gaps[1]
