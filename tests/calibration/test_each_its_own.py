"""Of several animals, points, quantities and searches each keeps what is its own; nothing is
simulated.
"""

import numpy as np
import pytest

from feeler.calibration import traces as recording
from feeler.calibration import traces as trace
from feeler.calibration.fitting import make_starts
from feeler.calibration.hinges import Hinges
from feeler.calibration.traces import Traces
from feeler.errors import InvalidInput

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
