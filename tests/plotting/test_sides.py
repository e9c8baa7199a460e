"""Pictures of a touch from the right are those of its mirror image; of an antenna touched on both
sides both are drawn.
"""

import numpy as np
import pytest
from matplotlib.figure import Figure

import feeler
from feeler.objects import Box
from feeler.plotting import plot_touch
from feeler.plotting import tensors as touch_movie
from tests.tensors._touches import antenna

TRIALS = [
    feeler.Trial(
        feature=Box(half_width=1.0, half_height=1.0),
        location=0.7,
        speed=0.4,
        lead=2.0,
        side=side,
    )
    for side in ("left", "right")
]


@pytest.fixture(scope="module")
def touches():
    options = {"duration": 40.0, "timestep": 0.02, "all_hinges": True}
    return [feeler.touch(antenna, trial, **options) for trial in TRIALS]


def draw(tensors):
    """The image and the label of its colours."""
    figure = Figure()
    plot_touch(tensors, figure)
    return figure.axes[0].images[0], figure.axes[1].get_ylabel()


def test_an_antenna_touched_on_both_sides_is_drawn_on_both(touches):
    """One touch from each side, one after the other, in a record that says no side."""
    left, right = (one.drop_vars("side") for one in touches)
    both = left.copy()
    both["curvature"] = left["curvature"] + right["curvature"].values[:, ::-1]
    image, label = draw(both)
    values = both["curvature"].values[0]
    top = np.abs(values).max()
    np.testing.assert_array_equal(image.get_array(), values)
    assert image.get_clim() == (-top, top) and label == "curvature [1/mm]"
    assert image.get_cmap().name != draw(left)[0].get_cmap().name


def test_a_record_without_a_side_hides_nothing(touches):
    """Of a touch from the right that does not say so, all is negative."""
    image, _ = draw(touches[1].drop_vars("side"))
    assert image.get_clim()[0] == -image.get_clim()[1] < 0


def test_a_film_of_a_touch_from_the_right_is_the_other_turned_over(touches, monkeypatch):
    films = []
    monkeypatch.setattr(touch_movie, "write_movie", lambda *given: films.append(given))
    for trial, tensors in zip(TRIALS, touches, strict=True):
        touch_movie.write_touch_movie(antenna, trial, tensors, "film.mp4", slower=10.0)
    seen = []
    for _, figure, move, count, _ in films:
        move(count // 2)
        ax, tensor, _ = figure.axes
        line = ax.collections[1]
        places = np.array(line.get_segments())
        seen.append(
            (ax.get_xlim(), places, line.get_array(), line.get_clim(), tensor.images[0])
        )
    (wide, points, bend, scale, image), (other, mirrored, same, scale_too, image_too) = seen
    assert other == (-wide[1], -wide[0])
    np.testing.assert_allclose(mirrored, points * [-1, 1], atol=1e-9)
    np.testing.assert_allclose(same, bend, atol=1e-9)
    np.testing.assert_allclose(scale_too, scale, atol=1e-9)
    np.testing.assert_allclose(image_too.get_array(), image.get_array(), atol=1e-9)
    assert np.abs(points[..., 0]).max() > 1.0
