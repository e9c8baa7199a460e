"""Bits against closed forms: two Gaussians, a linear channel, noise whose level tells."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from feeler.analysis import (
    compute_energies,
    compute_energy,
    compute_fisher,
    compute_information,
    compute_information_known_noise,
    find_noise,
    find_told,
    measure_information,
    scale_peaks,
)
from feeler.errors import InvalidInput
from feeler.objects import Common, Mixed, Relative

DRAWS = 20_000


def make_pair(distance, shape=(5, 40)):
    """Two tensors that far apart, in no special direction."""
    rng = np.random.default_rng(1)
    first, step = rng.standard_normal((2, *shape))
    return np.stack([first, first + distance * step / np.linalg.norm(step)])


def agree(value, error, truth, slack=1e-6):
    return abs(value - truth) <= 4.5 * error + slack


@pytest.mark.parametrize("separation", [0.3, 1.0, 2.5, 6.0])
def test_two_gaussians(separation):
    """Accuracy Φ(d′/2); bits by quadrature of the binary-input Gaussian channel."""
    sd = 0.7
    found = compute_information(make_pair(separation * sd), sd, n_draws=DRAWS)
    assert agree(found.accuracy, found.accuracy_error, norm.cdf(separation / 2))
    lost, _ = quad(
        lambda x: norm.pdf(x, separation**2 / 2, separation) * np.logaddexp(0, -x) / np.log(2),
        separation**2 / 2 - 12 * separation,
        separation**2 / 2 + 12 * separation,
    )
    assert agree(found.bits, found.bits_error, 1 - lost)
    assert found.bits_error < 0.01


@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_a_linear_channel(ratio):
    """Many touches, normally spread along one direction: ½ log₂(1 + signal-to-noise ratio)."""
    spread = norm.ppf((np.arange(200) + 0.5) / 200)
    direction = np.random.default_rng(2).standard_normal(30)
    tensors = spread[:, None] * direction / np.linalg.norm(direction)
    found = compute_information(tensors, 1 / np.sqrt(ratio), n_draws=40)
    assert agree(found.bits, found.bits_error, 0.5 * np.log2(1 + ratio), slack=0.01)


@pytest.mark.parametrize("entries", [12, 7, 6])
def test_the_short_way_equals_noise_drawn_whole(entries):
    """Also where the tensors leave hardly a direction, or none, to noise alone."""
    rng = np.random.default_rng(3)
    tensors, sd = rng.standard_normal((6, entries)), np.array([1.5, 1.5, 2.0, 1.2, 1.5, 1.6])
    found = measure_information(tensors @ tensors.T, sd, entries=entries, n_draws=DRAWS)
    sent = rng.integers(6, size=60_000)
    noisy = tensors[sent] + sd[sent, None] * rng.standard_normal((sent.size, entries))
    log = -entries * np.log(sd) - ((noisy[:, None] - tensors) ** 2).sum(axis=2) / (2 * sd**2)
    posterior = np.exp(log - log.max(axis=1, keepdims=True))
    posterior /= posterior.sum(axis=1, keepdims=True)
    right = posterior.argmax(axis=1) == sent
    assert agree(
        found.accuracy,
        np.hypot(found.accuracy_error, right.std() / np.sqrt(sent.size)),
        right.mean(),
    )
    bits = np.log2(6 * posterior[np.arange(sent.size), sent])
    assert agree(
        found.bits, np.hypot(found.bits_error, bits.std() / np.sqrt(sent.size)), bits.mean()
    )


def test_noise_at_an_accuracy():
    distance = 2.0
    sd, error = find_noise(make_pair(distance), 0.75, n_draws=5000)
    truth = brentq(lambda s: norm.cdf(distance / 2 / s) - 0.75, 0.1, 10)
    assert agree(sd, error, truth)
    assert error < 0.05
    assert np.isnan(find_noise(np.ones((3, 4)))[0])
    for accuracy in (0.5, 1.0):
        with pytest.raises(InvalidInput, match="accuracy must lie between 1/2"):
            find_noise(make_pair(1.0), accuracy)


def test_windows_are_what_each_window_gives():
    tensors = np.random.default_rng(6).standard_normal((5, 3, 12))
    windows = compute_energies(tensors, [4, 9, 12], start=2)
    for end, energy in zip([4, 9, 12], windows, strict=True):
        assert energy == pytest.approx(compute_energy(tensors[:, :, 2:end]))
    bits = [measure_information(energy, 1.0, n_draws=2000).bits for energy in windows]
    assert bits == sorted(bits)


def test_peaks():
    scaled = scale_peaks(np.array([[1.0, -4.0], [0.5, 0.1]]))
    assert np.abs(scaled).max(axis=1) == pytest.approx([1, 1])
    with pytest.raises(InvalidInput, match="tensor 1 is zero"):
        scale_peaks(np.array([[1.0], [0.0]]))
    with pytest.raises(InvalidInput, match="tensor 0 is zero everywhere, or not finite"):
        scale_peaks(np.array([[np.nan, 2.0], [1.0, 0.0]]))


def test_standard_errors_are_the_spread_over_repeated_draws():
    tensors = make_pair(1.0)
    found = [
        compute_information(tensors, 0.7, n_draws=60, random_state=seed) for seed in range(150)
    ]
    for value, error in (("bits", "bits_error"), ("accuracy", "accuracy_error")):
        spread = np.std([getattr(one, value) for one in found], ddof=1)
        assert np.mean([getattr(one, error) for one in found]) == pytest.approx(spread, rel=0.2)
    noise = np.array(
        [find_noise(tensors, 0.75, n_draws=60, random_state=seed) for seed in range(60)]
    )
    assert noise[:, 1].mean() == pytest.approx(noise[:, 0].std(ddof=1), rel=0.3)


@pytest.mark.parametrize(("n_draws", "known"), [(1, False), (2, True)])
def test_an_error_needs_two_pairs_of_draws(n_draws, known):
    found = compute_information(make_pair(1.0), 0.7, n_draws=n_draws)
    assert np.isfinite([found.bits_error, found.accuracy_error]).all() == known and np.isfinite(
        found.bits
    )


def test_windows_that_do_not_rise_are_refused():
    tensors = np.random.default_rng(6).standard_normal((5, 3, 12))
    assert compute_energies(tensors, [0, 12])[0] == pytest.approx(np.zeros((5, 5)))
    assert compute_energies(tensors, [3, 3])[1] == pytest.approx(
        compute_energy(tensors[:, :, :3])
    )
    for ends, start in (([13], 0), ([5, 13], 0), ([5, 4], 0), ([3], 4), ([3], -1)):
        with pytest.raises(InvalidInput, match="ends must rise"):
            compute_energies(tensors, ends, start=start)


@pytest.mark.parametrize(
    ("tensors", "sd", "message"),
    [
        (np.ones((1, 3)), 1.0, "at least two"),
        (np.array([[1.0], [np.nan]]), 1.0, "finite"),
        (np.array([[1.0, 2.0], [3.0, np.inf]]), 1.0, "finite"),
        (np.ones((2, 3)), 0.0, "sd must be one number > 0"),
        (np.ones((2, 3)), np.array([1.0, -1.0]), "sd must be one number > 0"),
        (np.ones((2, 3)), np.array([1.0, np.nan]), "sd must be one number > 0"),
        (np.ones((2, 3)), np.ones(3), "one for each of the 2"),
        (np.ones((3, 2)), np.array([1.0, 1.0, 2.0]), "entries= must be the size of a tensor"),
    ],
)
def test_wrong_arguments_are_named(tensors, sd, message):
    with pytest.raises(InvalidInput, match=message):
        compute_information(tensors, sd)


@pytest.mark.parametrize(
    "energy",
    [np.ones((2, 3)), np.ones((3, 2)), np.ones((1, 1)), np.array([[1.0, 0.0], [0.0, np.nan]])],
)
def test_what_is_no_square_of_inner_products_is_refused(energy):
    with pytest.raises(
        InvalidInput, match=r"a finite square matrix|two trial axes of one size"
    ):
        measure_information(energy, 1.0)


@pytest.mark.parametrize("observe", [compute_information, compute_information_known_noise])
def test_next_to_no_noise_tells_all_touches_that_differ(observe):
    """Two of five are the same: log₂ 5 − 2/5 bits, however little noise there is."""
    one, two, three, four = np.random.default_rng(1).random((4, 5, 20))
    tensors = np.array([one, two, three, two, four])
    for sd in (1e-6, 1e-9, 1e-15, 1e-60, 1e-130):
        found = observe(
            tensors,
            np.full((1, 1, 1), sd) if observe is compute_information_known_noise else sd,
        )
        assert found.bits == pytest.approx(np.log2(5) - 2 / 5)
    lost = observe(
        tensors,
        np.full((1, 1, 1), 1e130) if observe is compute_information_known_noise else 1e130,
    )
    assert lost.bits == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("sd", [1e-300, 1e-200, 1e200, 1e300])
def test_noise_that_no_number_spans_is_refused(sd):
    tensors = np.random.default_rng(0).random((5, 4, 10))
    for ask in (
        lambda: compute_information(tensors, sd),
        lambda: compute_information(tensors, np.array([1.0, 1.0, 1.0, 1.0, sd])),
        lambda: compute_information_known_noise(tensors, np.full((1, 1, 1), sd)),
        lambda: measure_information(compute_energy(tensors), sd),
    ):
        with pytest.raises(InvalidInput, match="sd must lie between 1e-140 and 1e"):
            ask()


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e200, 1e300])
def test_products_that_are_no_numbers_are_refused(scale):
    tensors = scale * np.random.default_rng(0).random((5, 4, 10))
    for ask in (
        lambda: compute_energy(tensors),
        lambda: compute_energies(tensors, [5, 10]),
        lambda: compute_fisher(tensors, 1.0),
    ):
        with pytest.raises(InvalidInput, match="squares are numbers"):
            ask()


@pytest.fixture
def tensors():
    steps = np.random.default_rng(0).standard_normal((6, 4, 30))
    return np.cumsum(steps, axis=2) * 0.05


@pytest.mark.parametrize("sd", [0.4, 0.9])
def test_of_even_noise_it_is_the_ideal_observer(tensors, sd):
    own = compute_information_known_noise(
        tensors, np.full(tensors.shape, sd), n_draws=3000, random_state=1
    )
    ideal = compute_information(tensors, sd, n_draws=3000)
    assert own.accuracy == pytest.approx(ideal.accuracy, abs=4 * own.accuracy_error)
    assert own.bits == pytest.approx(ideal.bits, abs=4 * own.bits_error)


@pytest.mark.long
@pytest.mark.parametrize("noise", [Mixed(0.5, share=1.0, each="vector"), Mixed(0.5, share=2.0)])
def test_the_short_way_equals_uneven_noise_drawn_whole(tensors, noise):
    sd = np.broadcast_to(noise.sd(tensors), tensors.shape)
    met = noise.add(tensors, np.random.default_rng(2), 3000).reshape(3000, 6, -1)
    weight = 1 / np.mean(sd**2, axis=0).ravel()
    far = met[:, :, None] - tensors.reshape(6, -1)
    logs = -0.5 * np.sum(far**2 * weight, axis=3)
    right = np.mean(logs.argmax(axis=2) == np.arange(6))
    own = np.diagonal(logs, axis1=1, axis2=2) - np.logaddexp.reduce(logs, axis=2)
    found = compute_information_known_noise(tensors, noise.sd(tensors), n_draws=3000)
    assert found.accuracy == pytest.approx(right, abs=0.015)
    assert found.bits == pytest.approx(np.log2(6) + own.mean() / np.log(2), abs=0.05)


def test_the_size_of_the_noise_alone_tells_nothing():
    """An observer who took it for a signal would know each of these at any level."""
    rng = np.random.default_rng(3)
    sd = 0.5 + rng.random((5, 4000))
    assert compute_information_known_noise(np.ones((5, 4000)), sd).bits == pytest.approx(
        0.0, abs=1e-9
    )


@pytest.mark.parametrize("noise", [Common(1.0), Relative(1.0), Mixed(1.0, share=5.0)])
def test_at_the_level_found_that_share_is_named_right(tensors, noise):
    sd = noise.sd(tensors)
    level = find_told(tensors, sd, 0.75, n_draws=400)
    assert compute_information_known_noise(
        tensors, level * sd, n_draws=400
    ).accuracy == pytest.approx(0.75, abs=0.01)


def test_the_level_of_common_noise_is_that_of_even_noise(tensors):
    level = find_told(tensors, Common(1.0).sd(tensors), 0.75, n_draws=400)
    assert level == pytest.approx(find_noise(tensors, 0.75)[0], rel=0.05)


def test_touches_that_are_the_same_have_no_level(tensors):
    same = np.repeat(tensors[:1], 3, axis=0)
    assert np.isnan(find_told(same, np.ones_like(same)))


@pytest.mark.parametrize(
    ("sd", "said"),
    [
        (np.ones((6, 4, 31)), "shape"),
        (np.zeros((6, 4, 30)), "sd > 0 everywhere"),
        (np.full((6, 4, 30), np.nan), "finite"),
    ],
)
def test_noise_that_cannot_be_is_refused(tensors, sd, said):
    with pytest.raises(InvalidInput, match=said):
        compute_information_known_noise(tensors, sd)
    with pytest.raises(InvalidInput, match="at least two tensors"):
        compute_information_known_noise(tensors[:1], np.ones((1, 4, 30)))


@pytest.mark.parametrize("sd", [[[0.3], [2.4]], [[0.2, 1.5], [2.0, 0.7]]], ids=["one", "two"])
def test_of_two_touches_it_tells_what_the_normal_law_of_its_log_odds_says(sd):
    """Touches at ±x: with entries weighed by w = 1 / ⟨g²⟩ the log odds of the true one are normal,
    with a mean of 2 Σ w x² and an sd of 2 √(Σ w² g² x²); their bits are 1 − ⟨log₂(1 + 1/odds)⟩.
    """
    g = np.array(sd)
    x = np.array([0.6, 0.9])[: g.shape[1]]
    weight = 1 / np.mean(g**2, axis=0)
    middle = np.full(2, 2 * np.sum(weight * x**2))
    spread = 2 * np.sqrt(np.sum((weight * g * x) ** 2, axis=1))
    z, share = np.polynomial.hermite_e.hermegauss(120)
    odds = middle[:, None] + spread[:, None] * z
    lost = (np.logaddexp(0, -odds) * share / share.sum()).sum(axis=1) / np.log(2)
    found = compute_information_known_noise(np.stack([-x, x]), g, n_draws=100_000)
    right = norm.cdf(middle / spread).mean()
    assert found.accuracy == pytest.approx(right, abs=4 * found.accuracy_error)
    assert found.bits == pytest.approx(1 - lost.mean(), abs=4 * found.bits_error)
    assert found.bits_error < 0.003


def test_levels_of_noise_alone_tell():
    """Equal tensors under two levels of noise: the energy of the noise is a χ² variable, and the
    rest is a threshold.
    """
    entries, low, high = 50, 1.0, 1.2
    found = compute_information(np.zeros((2, entries)), np.array([low, high]), n_draws=DRAWS)
    edge = entries * np.log((high / low) ** 2) / (1 / low**2 - 1 / high**2)
    truth = (chi2.cdf(edge / low**2, entries) + chi2.sf(edge / high**2, entries)) / 2
    assert agree(found.accuracy, found.accuracy_error, truth)
