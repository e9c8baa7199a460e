"""Of several animals, points, quantities and searches each keeps what is its own; nothing is
simulated.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from feeler.calibration import traces as own
from feeler.calibration import traces as recording
from feeler.calibration import traces as trace
from feeler.calibration.fitting import bootstrap, make_starts
from feeler.calibration.hinges import Band, Hinges, _make_scale
from feeler.calibration.problem import make_targets
from feeler.calibration.traces import Traces
from feeler.errors import InvalidInput

from .small_antenna import make_small

TIME = np.arange(0.0, 60.0, 1.5)


def swing(period, height):
    """A trace that swings and dies down."""
    return height * np.exp(-TIME / 30) * np.cos(2 * np.pi * TIME / period)


def make_traces():
    """Two animals, of which one has three points, in no order and of other heights."""
    names = ("b@0.4", "a", "b", "b@0.7")
    rows = [swing(20, 2.0), swing(25, -9.0), swing(20, 7.0), swing(20, 4.0)]
    return Traces(time=TIME, displacement=np.array(rows), names=names)


def test_an_animal_s_points_rise_and_stand_beside_their_own_places():
    traces = make_traces()
    assert traces.animals == ("b", "a")
    places, rows = traces.take("b")
    assert places.tolist() == [0.4, 0.7, 1.0] and rows[:, 0].tolist() == [2.0, 4.0, 7.0]
    assert traces.take("a")[0].tolist() == [1.0]
    with pytest.raises(InvalidInput, match=r"trace 'c@1\.5': what follows @ is a fraction"):
        recording._get_place("c@1.5")


def test_the_spread_of_few_animals_is_student_s_and_of_one_its_residuals():
    xs = np.array([[0.1, 0.5], [0.3, 0.4], [0.8, 0.9]])
    middle, covariance, reach, words = own._measure_spread(xs, np.eye(2), 0.9, 50)
    np.testing.assert_allclose(middle, xs.mean(axis=0))
    np.testing.assert_allclose(np.diag(covariance), xs.var(axis=0, ddof=1) / 3)
    assert covariance[0, 1] == pytest.approx(np.cov(xs.T)[0, 1] / 3)
    assert reach == pytest.approx(2.919986, rel=1e-6) and "3 animals" in words  # t(0.95, 2)
    one = own._measure_spread(xs[:1], 4 * np.eye(2), 0.95, 12)
    assert one[2] == pytest.approx(2.228139, rel=1e-6)  # t(0.975, 10)
    np.testing.assert_array_equal(one[1], 4 * np.eye(2))


def test_draws_are_means_of_as_many_animals_as_there_were():
    """Of two targets with other spreads, through a plain derivative; cut at the bounds."""
    antenna = make_small()
    family = _make_scale(antenna)
    targets = make_targets(frequency=(0.02, 0.004), damping_ratio=(0.3, 0.03))
    problem = SimpleNamespace(hinges=family, targets=targets)
    known = SimpleNamespace(jacobian=np.diag([2.0, -0.5]))
    for n_animals in (4, 9):
        drawn = bootstrap.__wrapped__(
            problem,
            family.start,
            np.random.default_rng(0),
            n_draws=6000,
            n_animals=n_animals,
            directions=known,
        )
        spread = np.log(drawn).std(axis=0)
        shares = np.array([0.2, 0.1]) / np.sqrt(n_animals)
        np.testing.assert_allclose(spread, shares / [2.0, 0.5], rtol=0.05)


def make_family(**more):
    """Two parameters, of which one may be negative."""
    known = {
        "name": "own",
        "names": ("stiff", "rate"),
        "units": ("N", "1/joint"),
        "positive": (True, False),
        "start": np.array([2.0, -0.1]),
        "low": np.array([0.5, -0.4]),
        "high": np.array([8.0, 0.4]),
        "build": lambda p: p,
    }
    return Hinges(**known | more)


def test_a_family_s_numbers_are_searched_each_in_its_own_way():
    family = make_family()
    np.testing.assert_allclose(family.to_x([2.0, -0.1]), [np.log(2.0), -0.1])
    np.testing.assert_allclose(family.to_p([[np.log(3.0), 0.2]] * 2), [[3.0, 0.2]] * 2)
    np.testing.assert_allclose(family.scale, [1.0, 0.1])
    np.testing.assert_allclose(family.bounds, [[np.log(0.5), -0.4], [np.log(8.0), 0.4]])
    starts = make_starts(family, 200, np.random.default_rng(1), spread=0.3)
    np.testing.assert_allclose(starts[0], family.start)
    moved = np.array([family.to_x(p) for p in starts[1:]]) - family.to_x(family.start)
    np.testing.assert_allclose(moved.std(axis=0), [0.3, 0.03], rtol=0.15)
    with pytest.raises(InvalidInput, match=r"rate starts at 0\.7, outside its bounds -0\.4 to"):
        make_family(start=np.array([2.0, 0.7]))
    with pytest.raises(
        InvalidInput, match="one of each for every parameter, got names 3, units 2"
    ):
        make_family(names=("a", "b", "c"))
    with pytest.raises(InvalidInput, match="lower bound of a positive parameter must be > 0"):
        make_family(low=np.array([0.0, -0.4]))


def test_a_band_is_known_best_where_it_is_narrowest_each_quantity_for_itself():
    def describe(factor):
        place, middle = np.array([0.0, 0.4, 0.9]), np.ones((2, 3))
        return Band(
            place=place, middle=middle, low=middle / factor, high=middle * factor
        ).describe()

    assert describe(np.array([[1.5, 1.2, 3.0], [1.1, 4.0, 2.0]])) == (
        "stiffness is known best at 0.40 of the length (within a factor of 1.2) and worst at 0.90"
        " (3); damping is known best at 0.00 of the length (within a factor of 1.1) and worst at"
        " 0.40 (4)."
    )
    alike = describe(np.array([[1.5, 1.2, 3.0], np.full(3, 1.41) * (1 + 1e-13 * np.arange(3))]))
    assert alike.endswith("0.90 (3); damping is known within a factor of 1.41 everywhere.")


def test_times_and_frames_become_milliseconds_since_the_first(tmp_path):
    rows = "\n".join(f"{4 + k},{v:.6g},{2 * v:.6g}" for k, v in enumerate(swing(20, 3.0)))
    for column, how, step in (("frame", {"frame_rate": 400.0}, 2.5), ("time_s", {}, 1000.0)):
        (tmp_path / "t.csv").write_text(f"{column},x,y@0.5\n{rows}\n")
        traces = recording.load_traces(tmp_path / "t.csv", **how)
        np.testing.assert_allclose(traces.time[:3], [0.0, step, 2 * step])
        assert traces.names == ("x", "y@0.5") and traces.source == "recorded"
        np.testing.assert_allclose(
            traces.displacement[1], 2 * traces.displacement[0], rtol=1e-5
        )
    with pytest.raises(InvalidInput, match="a frame rate is for a column called frame"):
        recording.load_traces(tmp_path / "t.csv", frame_rate=30.0)


def test_a_release_is_the_last_held_sample_of_either_sign_and_rest_is_the_end_s():
    fall = np.concatenate([np.full(9, 5.0), 5.0 * np.exp(-np.arange(1, 60) / 4)])
    for sign, level in ((1, 0.0), (-1, 12.0)):
        last, rest = trace.find_release(level + sign * fall)
        assert last == 8 and rest == pytest.approx(level, abs=0.01)
    late = np.concatenate([fall[5:], np.zeros(5)])
    with pytest.raises(InvalidInput, match="let go within the first 5 samples"):
        trace.find_release(late, "animal")


def test_targets_keep_their_names_beside_their_own_values():
    targets = make_targets("t", "synthetic", damping_ratio=(0.3, 0.02), frequency=0.02)
    assert (targets.names, targets.spreads.tolist()) == (
        ("damping_ratio", "frequency"),
        [0.02, 0],
    )
    assert [one.unit for one in targets.targets] == ["1", "kHz"]
    other = targets.with_values(np.array([0.5, 0.03]))
    assert other.values.tolist() == [0.5, 0.03] and other.spreads.tolist() == [0.02, 0.0]
    assert targets.only("frequency").values.tolist() == [0.02]
