"""The robot's speeds and profiles: controls of the same compliance, and each group measured by
itself.
"""

import numpy as np
import pytest

from feeler.analysis import compute_dispersion
from feeler.decoding import Relative, compute_sweep
from feeler.robot import make_robot, make_touches
from paper import fig6_data
from paper.fig6_data import (
    _PROFILES,
    compute_comparison,
    make_profiles,
)


def test_profiles_have_one_compliance_and_one_damping_time():
    profiles = make_profiles()
    assert tuple(profiles) == _PROFILES
    robot = make_robot()
    for name, antenna in profiles.items():
        assert np.sum(1 / antenna.stiffness) == pytest.approx(np.sum(1 / robot.stiffness))
        np.testing.assert_allclose(
            antenna.damping / antenna.stiffness, robot.damping[0] / robot.stiffness[0]
        )
        assert antenna.name == f"robot {name}"
    assert np.ptp(profiles["uniform"].stiffness) == 0
    exponential = profiles["exponential"].stiffness
    np.testing.assert_allclose(exponential[1:] / exponential[:-1], 0.1 ** (1 / 7))


def test_each_speed_and_each_profile_is_measured_by_itself(monkeypatch):
    """Random tensors in the place of touches: those of the linear profile and the slow speed are
    the robot's own.
    """
    planted = {}

    def touch(antenna, speed, engine):
        assert engine == "mujoco"
        rng = np.random.default_rng(len(planted))
        alike = 5 + 0.8 * rng.random((10, 8, 30))  # so that noise hides some
        planted[antenna.name, speed] = alike * (1 + len(planted))
        return planted[antenna.name, speed]

    monkeypatch.setattr(fig6_data, "touch_robot", touch)
    found = compute_comparison(engine="mujoco", n_repeats=2, random_state=3)
    groups = {f"{v:g} m/s": planted["robot linear", v] for v in (0.27, 0.135, 0.027)}
    slow = {name: planted[f"robot {name}", 0.027] for name in _PROFILES}
    assert len(planted) == 5
    classes = [f"{trial.name} {trial.location:g}" for trial in make_touches()[:10]]
    for measured, expected in ((found["speed"], groups), (found["profile"], slow)):
        assert list(measured) == list(expected)
        names = np.repeat(list(expected), 10)
        dispersion = compute_dispersion(np.concatenate(list(expected.values())), list(names))
        for name, tensors in expected.items():
            noise = Relative(each="tensor")
            sweep = compute_sweep(
                tensors, classes, ratios=(0.2,), n_repeats=2, noise=noise, random_state=3
            )
            assert measured[name]["accuracy"] == pytest.approx(sweep.noisy.mean())
            assert (
                sweep.noisy.mean() < sweep.clean.mean() - 0.1
            )  # that of noisy copies, no other
            for index in ("pearson", "ssim", "mse", "nmi"):
                assert measured[name][index] == dispersion.average[index][name]
