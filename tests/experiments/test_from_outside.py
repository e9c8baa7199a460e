"""A shape and an engine from outside the package go all the way: touch, store, dispersion,
decoding, export.
"""

import numpy as np
import pytest
from objects._capsule import Capsule

import feeler
from feeler.analysis import compute_dispersion
from feeler.decoding import compute_sweep, make_labels
from feeler.objects import SHAPES, Trial

ANTENNA = feeler.Antenna(
    segment_length=np.full(14, 3.0),
    segment_mass=2e-4,
    radius=0.1,
    stiffness=np.linspace(0.2, 0.02, 14),
    damping=0.5,
)


@pytest.fixture
def trials():
    SHAPES.register("capsule", Capsule)
    yield [
        Trial(
            feature=Capsule(half_length=size, rounding=0.5),
            location=place,
            speed=0.3,
            approach=80,
        )
        for size in (0.5, 3.0)
        for place in (0.6, 0.9)
    ]
    SHAPES.unregister("capsule")


def test_every_engine_feels_a_new_shape_as_mujoco_does(trials):
    def touch(engine):
        return feeler.touch(
            ANTENNA, trials[2], duration=30, engine=engine, timestep=0.02
        ).angle.values

    reference = touch("mujoco")
    peak = np.abs(reference).max()
    assert peak > 0.01
    np.testing.assert_allclose(touch("chain"), reference, rtol=0, atol=1e-9 * peak)
    np.testing.assert_allclose(touch("chain-consistent"), reference, rtol=0, atol=0.01 * peak)


@pytest.mark.long
def test_a_new_shape_goes_from_touch_to_export(trials, tmp_path):
    tensors = feeler.touch(ANTENNA, trials, duration=40, store=tmp_path / "store")
    angle = tensors.angle.values
    again = feeler.load(tmp_path / "store")
    np.testing.assert_array_equal(again.angle.values, angle)
    assert set(again.feature.values) == {"capsule"}
    found = compute_dispersion({"capsules": angle})
    flat = angle.reshape(len(angle), -1)
    expected = (
        np.corrcoef(flat)[~np.eye(len(flat), dtype=bool)].reshape(len(flat), -1).max(axis=1)
    )
    np.testing.assert_allclose(found.values("pearson", "capsules"), expected, rtol=1e-9)
    sweep = compute_sweep(
        angle, make_labels(tensors), ratios=(0.05,), n_repeats=1, n_copies=10, random_state=0
    )
    assert sweep.noisy.mean() > 0.9  # four touches that differ, hardly any noise
    feeler.save(tensors, tmp_path / "touches.nc")
    np.testing.assert_array_equal(feeler.load(tmp_path / "touches.nc").angle.values, angle)
