"""The four indices agree with NumPy, scikit-image and scikit-learn, in any block size."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from skimage.metrics import structural_similarity
from sklearn.metrics import normalized_mutual_info_score

from feeler.analysis import compute_mse, compute_nmi, compute_pearson, compute_ssim
from feeler.analysis.indices import digitise
from feeler.errors import InvalidInput

ALL = [compute_pearson, compute_ssim, compute_mse, compute_nmi]
MATLAB = {
    "gaussian_weights": True,
    "sigma": 1.5,
    "use_sample_covariance": False,
    "data_range": 1.0,
}


def make_noise(n=5, shape=(14, 33), seed=0):
    return np.random.default_rng(seed).random((n, *shape))


def make_contacts(n=6, seed=1):
    """Smooth bumps on a background of zeros, scaled to [0, 1]: what tactile tensors look like."""
    rng = np.random.default_rng(seed)
    tensors = np.zeros((n, 56, 90))
    for tensor in tensors:
        tensor[rng.integers(10, 50), rng.integers(20, 70)] = rng.uniform(0.5, 2.0)
    tensors = gaussian_filter(tensors, (0, 3, 8))
    tensors[tensors < 1e-5] = 0.0
    return tensors / tensors.max()


@pytest.fixture(params=[make_noise, make_contacts], ids=["noise", "contacts"])
def tensors(request):
    return request.param()


def loop(tensors, compare):
    return np.array([[compare(a, b) for b in tensors] for a in tensors])


def test_pearson_equals_numpy(tensors):
    expected = loop(tensors, lambda a, b: np.corrcoef(a.ravel(), b.ravel())[0, 1])
    np.testing.assert_allclose(compute_pearson(tensors), expected, atol=1e-10)


def test_mse_equals_numpy(tensors):
    np.testing.assert_allclose(
        compute_mse(tensors), loop(tensors, lambda a, b: ((a - b) ** 2).mean()), atol=1e-14
    )


def test_mse_of_nearly_equal_tensors_keeps_its_digits():
    a = 1e3 + make_noise(1)[0]
    b = a + 1e-7 * make_noise(1, seed=9)[0]
    expected = ((a - b) ** 2).mean()
    assert compute_mse(np.stack([a, b]))[0, 1] == pytest.approx(expected, rel=1e-12)


def test_ssim_reflect_equals_the_mean_of_scikit_images_full_map(tensors):
    expected = loop(
        tensors, lambda a, b: structural_similarity(a, b, full=True, **MATLAB)[1].mean()
    )
    np.testing.assert_allclose(compute_ssim(tensors, border="reflect"), expected, atol=1e-10)


@pytest.mark.parametrize("data_range", [0.3, 1.0, 255.0])
def test_ssim_of_any_range_equals_scikit_image(data_range):
    """C1 = (0.01 L)², C2 = (0.03 L)² (Wang et al. 2004, https://doi.org/10.1109/TIP.2003.819861)."""
    tensors = data_range * make_noise(3)
    expected = loop(
        tensors,
        lambda a, b: structural_similarity(a, b, **(MATLAB | {"data_range": data_range})),
    )
    np.testing.assert_allclose(
        compute_ssim(tensors, border="interior", data_range=data_range), expected, atol=1e-10
    )


def ssim_slowly(a, b, mode):
    """SSIM written out with SciPy's filter; ``mode`` nearest repeats the edges, as MATLAB's ssim
    does.
    """

    def blur(x):
        return gaussian_filter(x, 1.5, mode=mode, radius=5)

    ma, mb = blur(a), blur(b)
    va, vb, cov = blur(a * a) - ma**2, blur(b * b) - mb**2, blur(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    return (
        (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    ).mean()


@pytest.mark.parametrize("rows", [3, 56])
def test_ssim_replicate_equals_the_definition_with_repeated_edges(rows):
    tensors = make_noise(4, (rows, 40))
    expected = loop(tensors, lambda a, b: ssim_slowly(a, b, "nearest"))
    np.testing.assert_allclose(compute_ssim(tensors, border="replicate"), expected, atol=1e-10)


@pytest.mark.parametrize("n_bins", [32, 64, 100, 256])
def test_nmi_equals_scikit_learn(tensors, n_bins):
    levels = digitise(tensors.reshape(len(tensors), -1), n_bins, tensors.min(), tensors.max())
    expected = loop(levels, normalized_mutual_info_score)
    np.testing.assert_allclose(compute_nmi(tensors, n_bins=n_bins), expected, atol=1e-10)


def test_nmi_without_common_zeros_equals_scikit_learn_on_the_rest():
    tensors = make_contacts()
    levels = digitise(tensors.reshape(len(tensors), -1), 256, 0.0, 1.0)

    def compare(a, b):
        keep = (a > 0) | (b > 0)
        return normalized_mutual_info_score(a[keep], b[keep])

    got = compute_nmi(tensors, common_zeros="drop", data_range=(0.0, 1.0))
    np.testing.assert_allclose(got, loop(levels, compare), atol=1e-10)
    assert got[0, 1] < compute_nmi(tensors)[0, 1]


@pytest.mark.parametrize("data_range", [(0.0, 1.0), (-0.5, 2.0), (0.2, 0.8)])
def test_nmi_counts_in_equal_bins_over_the_range_given(data_range):
    """What lies outside goes into the outer bins, as ``numpy.histogram`` of what is clipped would
    have it.
    """
    tensors, (low, high) = make_noise(3), data_range
    inner = np.linspace(low, high, 17)[1:-1]
    levels = np.searchsorted(inner, tensors.reshape(3, -1), side="right")
    got = compute_nmi(tensors, n_bins=16, data_range=data_range)
    np.testing.assert_allclose(got, loop(levels, normalized_mutual_info_score), atol=1e-10)


def test_tensors_that_are_equal_or_empty_beside_the_common_zeros_are_alike():
    tensors = np.zeros((3, 4, 5))
    tensors[2, 1, 1] = 1.0
    got = compute_nmi(tensors, common_zeros="drop", data_range=(0.0, 1.0))
    assert got[0, 1] == 1.0
    assert got[0, 2] == pytest.approx(1.0)  # one entry is left, in which neither varies


@pytest.mark.parametrize("compute", ALL)
@pytest.mark.parametrize("block", [1, 2, 4])
def test_blocks_change_nothing(compute, block):
    tensors = make_noise(7)
    np.testing.assert_allclose(compute(tensors, block=block), compute(tensors), atol=1e-13)


def test_many_bad_trials_are_counted_after_the_first_eight():
    tensors = np.ones((10, 12, 12))
    for n, words in ((10, " and 2 more"), (8, "")):
        words = rf"trial\(s\) 0, 1, 2, 3, 4, 5, 6, 7{words} are constant .* undefined"
        with pytest.raises(InvalidInput, match=words):
            compute_pearson(tensors[:n])


def test_the_other_indices_take_a_constant_tensor():
    tensors = make_noise()
    tensors[3] = 0.0
    for compute in (compute_ssim, compute_mse, compute_nmi):
        assert np.isfinite(compute(tensors)).all()
    assert compute_nmi(tensors)[3, 0] == 0.0


def test_ssim_warns_when_its_constants_swamp_the_signal():
    with pytest.warns(UserWarning, match="scale_common"):
        compute_ssim(0.05 * make_noise())


@pytest.mark.parametrize("compute", ALL)
@pytest.mark.parametrize(
    ("tensors", "message"),
    [
        (np.zeros((4, 5)), r"got shape \(4, 5\)"),
        (np.ones((1, 12, 12)), "at least 2"),
        ([np.ones((3, 4)), np.ones((3, 5))], "same number of sensors and samples"),
        (np.full((3, 12, 12), np.nan), "NaN"),
        (
            np.where(np.arange(4)[:, None, None] == 2, np.inf, np.ones((4, 12, 12))),
            r"trial\(s\) 2 hold NaN or infinite",
        ),
    ],
)
def test_input_that_is_no_set_of_tensors_is_refused(compute, tensors, message):
    with pytest.raises(InvalidInput, match=message):
        compute(tensors)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: compute_ssim(x, border="wrap"), "replicate, reflect, interior"),
        (lambda x: compute_ssim(x, data_range=0.0), "data_range must be > 0"),
        (
            lambda x: compute_ssim(x[:, :3], border="interior"),
            "smaller than the 11 × 11 window",
        ),
        (lambda x: compute_nmi(x, n_bins=1), "between 2 and 256"),
        (lambda x: compute_nmi(x, data_range=(1.0, 0.0)), "from low to high"),
        (lambda x: compute_nmi(x, common_zeros="no"), "keep, drop"),
        (lambda x: compute_mse(x, block=0), "block must be"),
        (lambda x: compute_mse(x * 1e-170), "squares are numbers"),
        (lambda x: compute_ssim(x * 1e-170, data_range=1e-170), "square that is a number"),
    ],
)
def test_options_out_of_range_are_refused(call, message):
    with pytest.raises(InvalidInput, match=message):
        call(make_noise())


def test_ssim_interior_equals_scikit_image(tensors):
    expected = loop(tensors, lambda a, b: structural_similarity(a, b, **MATLAB))
    np.testing.assert_allclose(compute_ssim(tensors, border="interior"), expected, atol=1e-10)


@pytest.mark.parametrize("compute", ALL)
def test_matrix_is_symmetric_with_its_own_diagonal(compute, tensors):
    matrix = compute(tensors)
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_allclose(
        np.diag(matrix), 0.0 if compute is compute_mse else 1.0, atol=1e-12
    )


def test_pearson_of_a_constant_tensor_is_refused_and_named():
    tensors = make_noise()
    tensors[3] = 0.25
    with pytest.raises(InvalidInput, match=r"trial\(s\) 3 are constant .* undefined"):
        compute_pearson(tensors)
