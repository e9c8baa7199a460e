"""Extremes: an answer that does not depend on the timestep, or a refusal with a name; never a
crash, never nonsense.
"""

import numpy as np
import pytest
from scripts import load_script

from feeler.antenna import Antenna
from feeler.errors import SimulationDivergedError
from feeler.objects.shapes import make_feature
from feeler.objects.trials import Trial
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene

numerics = load_script("benchmarks", "numerics")

GOOD_ENDS = ("finite", "diverged (named)", "refused: ")


@pytest.mark.parametrize(
    ("options", "fields"),
    [
        ({}, {}),
        ({"stiffness": 1e-6}, {}),
        ({"stiffness": 10.0}, {}),
        ({"stiffness": 10.0, "damping": 10.0}, {}),
        ({"n_segments": 10}, {"speed": 1e-3}),
        ({"n_segments": 20}, {"speed": 1.0}),
        ({"n_segments": 20}, {"feature": make_feature("ball", 0.05)}),
        ({"n_segments": 20}, {"feature": make_feature("box", 20.0)}),
    ],
)
def test_inside_the_safe_region_the_timestep_does_not_matter(options, fields):
    trial = Trial(
        **{"feature": make_feature("ball", 1.5), "location": 0.7, "speed": 0.3, **fields}
    )
    verdict, change, timestep = numerics.judge(numerics.make_antenna(**options), trial, 12.0)
    assert (verdict, timestep) == ("holds", numerics.TIMESTEP)
    assert change < 0.01


def test_a_feature_bigger_than_the_antenna_is_refused_by_name():
    trial = Trial(feature=make_feature("ball", 50.0), location=0.7, speed=0.3)
    assert (
        numerics.judge(numerics.make_antenna(), trial, 12.0)[0]
        == "refused: the feature is bigger than the antenna"
    )


@pytest.mark.parametrize("engine", ["chain-consistent", "chain", "mujoco"])
@pytest.mark.parametrize("damping", [0.0, 0.001, 0.01])
def test_the_stability_limit_is_where_theory_puts_it(engine, damping):
    n = 5
    antenna = Antenna(
        segment_length=2.0 * np.ones(n),
        segment_mass=1e-3,
        radius=0.2,
        stiffness=100.0,
        damping=damping,
    )
    low, high = 1e-3, 10.0
    for _ in range(
        60
    ):  # bisect the timestep at which 4 M + 2 h C − h² K loses its positive definiteness
        middle = np.sqrt(low * high)
        low, high = (
            (middle, high) if numerics.is_free_stable(antenna, middle) else (low, middle)
        )
    start = 1e-3 * (-1.0) ** np.arange(n)

    def amplitude(timestep):
        clock = Clock(duration=400 * timestep, sample_interval=timestep, timestep=timestep)
        try:
            return np.abs(
                run_scene(Scene(antenna=antenna, angle=start), clock, engine).angle
            ).max()
        except SimulationDivergedError:
            return np.inf

    assert amplitude(0.95 * low) < 0.1
    assert amplitude(1.05 * low) > 0.1


@pytest.mark.parametrize("n", [60, pytest.param(10_000, marks=pytest.mark.slow)])
def test_random_antennas_and_touches_end_in_an_answer_or_a_named_refusal(n):
    ends = numerics.run_random(n, seed=1, duration=10.0 if n < 1000 else 30.0)
    assert sum(ends.values()) == n
    assert all(end.startswith(GOOD_ENDS) for end in ends), ends
    refused = sum(count for end, count in ends.items() if end.startswith("refused"))
    assert ends["finite"] > 0.6 * (n - refused)
