"""Postures from sensors: exact where nothing is between them, as good as stated where something
is.
"""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.objects.trials import trials
from feeler.tensors.transforms import reconstruct_posture


def test_all_hinges_give_the_shape_itself():
    antenna = feeler.presets.cockroach()
    tensors = feeler.touch(antenna, trials()[:2], duration=30, all_hinges=True)
    shape = antenna.shape(tensors["angle"].transpose("trial", "time", "sensor").values)
    np.testing.assert_allclose(reconstruct_posture(tensors, antenna).values, shape, atol=1e-12)


@pytest.mark.parametrize(("profile", "limit"), [("exponential", 0.07), ("uniform", 0.02)])
def test_the_sensors_alone_give_it_within_the_stated_error(profile, limit):
    antenna = feeler.presets.cockroach(profile)
    tensors = feeler.touch(antenna, trials()[::9], duration=120, all_hinges=True)
    shape = antenna.shape(tensors["angle"].transpose("trial", "time", "sensor").values)
    found = reconstruct_posture(tensors.isel(sensor=antenna.sensors - 1), antenna)
    assert found.dims == ("trial", "time", "joint", "axis")
    error = np.linalg.norm(found.values - shape, axis=-1)
    assert abs(shape[..., -1, 0]).max() > 1.0
    assert 1e-6 < error.max() < limit


def test_a_uniform_arc_is_exact():
    """Constant curvature beyond a curved rest shape is what linear interpolation holds exactly."""
    antenna = feeler.presets.cockroach()
    antenna = antenna.replace(rest_angle=0.01 * np.sin(np.arange(140)))
    angle = antenna.rest_angle + 0.02 * antenna.segment_length
    trial = feeler.touch(antenna.replace(rest_angle=0.0), trials()[:1], duration=2)
    trial["angle"][:] = angle[antenna.sensors - 1][None, :, None]
    for given in (trial, trial[{"sensor": slice(None, None, -1)}]):  # whatever their order
        found = reconstruct_posture(given, antenna).values[0, 0]
        np.testing.assert_allclose(found, antenna.shape(angle), atol=1e-9)


def test_another_antenna_is_refused():
    antenna = feeler.presets.cockroach()
    tensors = feeler.touch(antenna, trials()[:1], duration=2)
    short = feeler.Antenna(
        segment_length=np.full(9, 1.0),
        segment_mass=1e-3,
        radius=0.1,
        stiffness=1.0,
        damping=1.0,
    )
    with pytest.raises(InvalidInput, match="has 9"):
        reconstruct_posture(tensors, short)


def test_curvature_in_space_is_that_of_both_bendings_and_not_of_torsion():
    import xarray as xr

    from feeler.tensors.transforms import compute_bend

    antenna = feeler.Antenna.from_beam(
        length=8.0,
        n_segments=4,
        planes=3,
        radius=0.1,
        modulus=90.0,
        shear_modulus=30.0,
        density=1e-3,
    )
    angle = np.random.default_rng(3).normal(0, 0.2, (1, 5, 3, 4))
    tensors = xr.Dataset(
        {"angle": (("trial", "time", "plane", "sensor"), angle, {"units": "rad"})},
        {"segment": ("sensor", np.arange(1, 5))},
    )
    expected = np.sqrt(angle[0, :, 0] ** 2 + angle[0, :, 1] ** 2) / 2.0
    np.testing.assert_allclose(compute_bend(tensors, antenna), expected)
