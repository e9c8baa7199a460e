"""What notebooks show: every result has a picture or a table of its own, and films play."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import feeler
from feeler.calibration import Film, ForceCurve
from feeler.decoding.sweeps import Sweep
from feeler.design.search import Candidate, Design, Optimum
from feeler.encoding import ConvolutiveNMF
from feeler.plotting.results import draw_measurements
from feeler.wall import Posture, approach


def make_sweep():
    return Sweep(
        ratios=np.array([0.0, 0.1, 0.3]),
        classes=np.array(["ball", "box"]),
        noisy=np.array([[1.0, 0.9], [0.8, 0.9], [0.6, 0.5]]),
        hits=np.arange(10) < np.array([[[10], [10]], [[9], [9]], [[7], [6]]]),
        confusion=np.array([[[9, 1], [0, 10]], [[8, 2], [3, 7]], [[6, 4], [5, 5]]]),
        kept_noisy=np.ones((3, 2)),
        kept_clean=np.ones((3, 2)),
    )


def make_optimum():
    return Optimum(
        start=np.zeros(2),
        best=Candidate(x=np.ones(2), cost=0.4, fate="simulated"),
        design=Design(antenna=feeler.presets.robot()),
        history=((1, 1.5), (4, 0.9), (7, 0.4)),
        counts={"simulated": 7},
        seconds=1.0,
    )


ASIDE = np.array([4.0, 4.0, 2.0, -1.0, *np.zeros(16)])


def make_curve():
    return ForceCurve(deflection=[0.0, 0.5, 1.0], force=[0.0, 1e-3, 2.5e-3], at=4.0)


def make_small_film():
    position = np.zeros((20, 2, 2))
    position[:, 1] = np.column_stack([ASIDE, np.full(20, 10.0)])
    return Film(
        position=position, bridged=False & (position[..., 0] > 0), place=[0.0, 1.0],
        interval=2.0, origin=[0.0, 0.0],
    )  # fmt: skip


def make_sweep_of_walls():
    return approach(
        feeler.presets.cockroach(), Posture(prebend="none", friction=0.0), [25.0, 9.0]
    )


@pytest.mark.further
@pytest.mark.parametrize(
    ("made", "axes", "lines"),
    [
        (make_curve, 1, [("force in mN", [0.0, 1.0, 2.5])]),
        (make_sweep, 3, [("clean", [100.0, 90.0, 65.0])]),
        (make_optimum, 2, [("search", [1.5, 0.9, 0.4])]),
        (make_small_film, 1, [("tip", ASIDE)]),
        (make_sweep_of_walls, 1, []),
    ],
    ids=["force", "sweep", "design", "film", "wall"],
)
def test_results_draw_their_own_numbers_and_show_them(made, axes, lines):
    result = made()
    figure = result.plot()
    assert len(figure.axes) == axes
    drawn = [
        np.asarray(line.get_ydata(), float).round(9) for ax in figure.axes for line in ax.lines
    ]
    for _, expected in lines:
        assert any(np.array_equal(expected, values) for values in drawn)
    html = result._repr_html_()
    assert '<img alt="' in html and "data:image/png;base64,iVBOR" in html
    assert f"<b>{type(result).__name__}</b>" in html


def test_an_interval_reaches_from_its_own_low_to_its_own_high():
    """Of uneven length: 0.1 down, 0.7 up."""
    ends = {
        "p": np.array([1.2, 3.0]),
        "low": np.array([1.1, 2.5]),
        "high": np.array([1.9, 3.1]),
    }
    antenna = feeler.presets.robot()
    fitted = SimpleNamespace(
        names=("stiffness", "damping_tilt"),
        each=ends["p"][None],
        determined=(True, False),
        start=antenna,
        antenna=antenna,
        **ends,
    )
    factors, _ = draw_measurements(fitted).axes
    spans = [one[:, 1].tolist() for bars in factors.collections for one in bars.get_segments()]
    np.testing.assert_allclose(spans, np.column_stack([ends["low"], ends["high"]]))


def test_an_encoder_shows_its_settings_and_then_its_bases():
    rng = np.random.default_rng(0)
    encoder = ConvolutiveNMF(2, 4, n_restarts=1, max_iter=3, random_state=0, warn=False)
    assert "<img" not in encoder._repr_mimebundle_()["text/html"]
    encoder.fit(rng.uniform(size=(3, 5, 30)))
    shown = encoder._repr_mimebundle_()["text/html"]
    assert "<img" in shown and "relative_residual_" in shown


def test_a_confusion_reads_down_what_was_and_across_what_it_was_taken_for():
    """Three of ten boxes are called a ball."""
    sweep = replace(make_sweep(), confusion=np.array([[[10, 0], [3, 7]]]))
    _, counts, _ = sweep.plot().axes
    (image,) = counts.images
    down, across = (
        [t.get_text() for t in axis.get_ticklabels()] for axis in (counts.yaxis, counts.xaxis)
    )
    said = {counts.get_ylabel(): down.index("box"), counts.get_xlabel(): across.index("ball")}
    assert image.get_array()[said["was"], said["taken for"]] == 30.0
    assert (counts.get_ylabel(), counts.get_xlabel()) == ("was", "taken for")
