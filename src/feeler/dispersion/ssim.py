"""Structural similarity (SSIM), as MATLAB and scikit-image compute it, for all pairs at once."""

import warnings
from typing import Any

import numba as nb
import numpy as np

from feeler.compiled import compiled
from feeler.dispersion.index import (
    BLOCK_SIZE,
    Block,
    Index,
    check_tensors,
    compare_pairs,
    fold_pairs,
    list_pairs,
)
from feeler.errors import InvalidInput
from feeler.records.checked import checked

_SIGMA = 1.5  # [B] MATLAB ssim's default Radius; Wang et al. 2004, doi:10.1109/TIP.2003.819861
_RADIUS = 5  # [B] window 11 × 11: ceil(3 · 1.5) in MATLAB, int(3.5 · 1.5 + 0.5) in scikit-image
_K1, _K2 = 0.01, 0.03  # [B] both libraries
_BORDERS = {"replicate": "edge", "reflect": "symmetric", "interior": None}
_CHUNKS = 64  # pieces of the pair list that threads take


@checked
def compute_ssim(
    tensors: Any, *, data_range: float = 1.0, border: str = "replicate", block: int = BLOCK_SIZE
) -> Any:
    """Mean SSIM between all pairs of tensors read as grey images (sensor × time).

    SSIM = (2 μa μb + C1)(2 σab + C2) / ((μa² + μb² + C1)(σa² + σb² + C2)), averaged over the image,
    with a Gaussian window (σ 1.5, 11 × 11), population (co)variances, C1 = (0.01 L)², C2 = (0.03
    L)², L = ``data_range``.

    Parameters
    ----------
    tensors
        (trial, sensor, time) scaled to about [0, ``data_range``] by one common factor
        (``scale_common``), never tensor by tensor: on raw angles the constants swamp the signal and
        SSIM → 1.
    data_range
        L.
    border
        ``replicate``: edges repeated, mean over the whole image (MATLAB's ``ssim``; the only one
        that can also take three activations as an image of three rows). ``interior``: mean over the
        pixels whose window lies inside the image (``skimage.metrics.structural_similarity``).
        ``reflect``: edges mirrored, mean over the whole image (the map that scikit-image returns
        with ``full=True``).
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) in [−1, 1], ones on the diagonal.

    Raises
    ------
    InvalidInput
        Unknown border, ``data_range`` ≤ 0, or an image smaller than the window with ``interior``.

    Notes
    -----
    Each tensor's means and variances are filtered once; per pair one separable filter of the
    product remains.
    """
    largest = np.abs(check_tensors(tensors)).max()
    if 0 < largest < 0.2 * data_range:
        warnings.warn(
            f"the largest entry is {largest:.3g}, far below data_range = {data_range:g}: SSIM's"
            " constants will swamp the signal and every pair will look alike. Scale the whole set"
            " first: scale_common(tensors).",
            stacklevel=2,
        )
    return compare_pairs(
        tensors, "ssim", _make_ssim, block, data_range=data_range, border=border
    )


def _make_ssim(
    array: np.ndarray, *, data_range: float = 1.0, border: str = "replicate"
) -> Block:
    """SSIM of two slices of a set."""
    _check(array, data_range, border)
    taps = _make_taps()
    c1, c2 = (_K1 * data_range) ** 2, (_K2 * data_range) ** 2

    def prepare(part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        images = _pad(array[part], border)
        mean, square = _filter_all(images, taps)
        return images, mean, square - mean**2

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = prepare(rows)
        b = a if rows == columns else prepare(columns)
        pairs = list_pairs(rows, columns)
        return fold_pairs(_compare_pairs(*a, *b, pairs, taps, c1, c2), pairs, rows, columns)

    return compute


SSIM = Index(label="SSIM", make=_make_ssim)


def _check(array: np.ndarray, data_range: float, border: str) -> None:
    if border not in _BORDERS:
        raise InvalidInput(f"border must be one of {', '.join(_BORDERS)}, got {border!r}.")
    if not data_range > 0:
        raise InvalidInput(f"data_range must be > 0, got {data_range}.")
    window = 2 * _RADIUS + 1
    if border == "interior" and min(array.shape[1:]) < window:
        raise InvalidInput(
            f"images of {array.shape[1]} × {array.shape[2]} are smaller than the {window} ×"
            f" {window} window. Use border='replicate'."
        )


def _make_taps() -> np.ndarray:
    offset = np.arange(-_RADIUS, _RADIUS + 1)
    taps = np.exp(-0.5 * (offset / _SIGMA) ** 2)
    return taps / taps.sum()


def _pad(images: np.ndarray, border: str) -> np.ndarray:
    mode: Any = _BORDERS[border]  # one of the words of numpy.pad
    if mode is None:
        return np.ascontiguousarray(images)
    return np.pad(images, ((0, 0), (_RADIUS, _RADIUS), (_RADIUS, _RADIUS)), mode=mode)


@compiled(inline="always")
def _filter(image, taps, column, out):
    """Separable Gaussian window over ``image`` into ``out``; ``column`` is working space."""
    height, width = out.shape
    padded = image.shape[1]
    for y in range(height):
        for x in range(padded):
            column[x] = (
                taps[5] * image[y + 5, x]
                + taps[4] * (image[y + 4, x] + image[y + 6, x])
                + taps[3] * (image[y + 3, x] + image[y + 7, x])
                + taps[2] * (image[y + 2, x] + image[y + 8, x])
                + taps[1] * (image[y + 1, x] + image[y + 9, x])
                + taps[0] * (image[y, x] + image[y + 10, x])
            )
        for x in range(width):
            out[y, x] = (
                taps[5] * column[x + 5]
                + taps[4] * (column[x + 4] + column[x + 6])
                + taps[3] * (column[x + 3] + column[x + 7])
                + taps[2] * (column[x + 2] + column[x + 8])
                + taps[1] * (column[x + 1] + column[x + 9])
                + taps[0] * (column[x] + column[x + 10])
            )


@compiled(parallel=True)
def _filter_all(images, taps):
    """Windowed mean and mean square of every image, (image, height − 10, width − 10) each."""
    n, height, width = images.shape
    mean = np.empty((n, height - 10, width - 10))
    square = np.empty_like(mean)
    for k in nb.prange(n):
        column = np.empty(width)
        _filter(images[k], taps, column, mean[k])
        _filter(images[k] * images[k], taps, column, square[k])
    return mean, square


@compiled(parallel=True)
def _compare_pairs(a, mean_a, variance_a, b, mean_b, variance_b, pairs, taps, c1, c2):
    """Mean SSIM of each pair (row of a, row of b)."""
    values = np.empty(len(pairs))
    height, width = a.shape[1:]
    n_chunks = min(_CHUNKS, len(pairs))
    for chunk in nb.prange(n_chunks):
        column = np.empty(width)
        product = np.empty((height, width))
        cross = np.empty((height - 10, width - 10))
        for p in range(chunk, len(pairs), n_chunks):
            i, j = pairs[p]
            for y in range(height):
                for x in range(width):
                    product[y, x] = a[i, y, x] * b[j, y, x]
            _filter(product, taps, column, cross)
            total = 0.0
            for y in range(cross.shape[0]):
                line = 0.0
                for x in range(cross.shape[1]):
                    m, n = mean_a[i, y, x], mean_b[j, y, x]
                    both = 2.0 * m * n
                    total_square = m * m + n * n
                    line += ((both + c1) * (2.0 * cross[y, x] - both + c2)) / (
                        (total_square + c1) * (variance_a[i, y, x] + variance_b[j, y, x] + c2)
                    )
                total += line
            values[p] = total / cross.size
    return values
