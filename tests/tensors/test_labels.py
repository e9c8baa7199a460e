"""Labels travel along, and ``dataset.feeler`` shows what a Dataset holds."""

import numpy as np
import pytest
import xarray as xr
from sklearn.utils import get_tags

import feeler
from feeler.analysis import compute_mse, compute_nmi, compute_pearson, compute_ssim
from feeler.errors import InvalidInput


@pytest.fixture(scope="module")
def touches():
    ball = feeler.Ball(radius=4)
    trials = [
        feeler.Trial(feature=ball, location=0.9, speed=speed) for speed in (0.2, 0.3, 0.4)
    ]
    return feeler.touch(feeler.presets.robot(), trials, duration=60)


def test_codes_carry_their_trials_and_times_and_are_the_same_numbers(touches):
    angle = abs(touches["angle"])
    encoder = feeler.ConvolutiveNMF(
        n_components=2, n_lags=5, n_restarts=1, max_iter=10, random_state=0, warn=False
    )
    plain = encoder.fit(angle.values).transform(angle.values)
    labelled = encoder.transform(angle)
    assert isinstance(plain, np.ndarray) and labelled.dims == ("trial", "component", "time")
    np.testing.assert_array_equal(labelled, plain)
    assert (
        labelled["speed"].values.tolist() == [0.2, 0.3, 0.4] and "sensor" not in labelled.coords
    )
    xr.testing.assert_identical(
        labelled["time"].drop_vars(labelled["time"].coords.keys() - {"time"}), angle["time"]
    )
    tags = get_tags(encoder).input_tags
    assert tags.three_d_array and not tags.two_d_array and tags.positive_only


@pytest.mark.parametrize("compute", [compute_pearson, compute_ssim, compute_mse, compute_nmi])
def test_matrices_over_pairs_know_whose_they_are(touches, compute):
    angle = touches["angle"] / float(abs(touches["angle"]).max())
    matrix = compute(angle)
    assert matrix.dims == ("trial", "other") and matrix["speed"].dims == ("trial",)
    np.testing.assert_array_equal(matrix, compute(angle.values))


@pytest.mark.long
def test_the_accessor_draws_and_rebuilds(touches, tmp_path):
    assert touches.feeler.antenna == feeler.presets.robot()
    posture = touches.feeler.posture()
    tip = posture.values[:, :, -1]
    np.testing.assert_allclose(
        tip, touches["tip"].transpose("trial", "time", "axis").values, atol=1e-6
    )
    figure = touches.feeler.plot(trial=1, variable="angle")
    assert figure._repr_png_()[1:4] == b"PNG"
    ax = figure.axes[0]
    np.testing.assert_array_equal(ax.images[0].get_array(), touches["angle"].values[1])
    movie = touches.feeler.movie(tmp_path / "m.mp4", trial=2, slower=20)
    assert movie.read_bytes()[4:8] == b"ftyp"
    assert movie._repr_html_().startswith("<video controls")
    assert type(movie)(tmp_path / "absent.mp4")._repr_html_().startswith("<a href=")


@pytest.mark.parametrize(
    ("ask", "match"),
    [
        (lambda ds: ds.feeler.plot(trial=3), "trial must be from 0 to 2, got 3"),
        (
            lambda ds: ds.feeler.plot(variable="tip"),
            "no tensor 'tip' in this Dataset; valid: angle, curvature",
        ),
        (
            lambda ds: ds.assign_attrs(configuration="{}").feeler.posture(),
            "does not say what one antenna",
        ),
    ],
)
def test_what_cannot_be_shown_is_said(touches, ask, match):
    with pytest.raises(InvalidInput, match=match):
        ask(touches)
