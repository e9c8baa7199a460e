"""Indices of how similar two tensors are: Pearson, MSE, SSIM and NMI, for all pairs at once."""

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from feeler.compiled import compiled
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.execute.workers import ThreadExecutor, count_cores
from feeler.records import Record, Registry
from feeler.tensors.transforms import (
    SQUARED,
    check_squares,
    label_like,
    refuse_masked,
    stack_planes,
)
from feeler.validation import checked

# Dispersion indices: ways to say how alike two tensors are.
#
# An index works on two slices of a set at a time, so that memory does not grow with the set.

BLOCK_SIZE = 256  # tensors per side of a block: 256 of 56 × 380 are 44 MB

Block = Callable[[slice, slice], np.ndarray]
"""Similarities of the tensors in one slice with those in another, (row, column)."""


class Index(Record):
    """One way to say how alike two tensors are.

    Attributes
    ----------
    label : str
        What figures and tables call it.
    make : Callable[..., Block]
        ``make(tensors, **options)`` for a set (trial, sensor, time): a function of two slices of
        its trials that gives the index of each pair, (row, column).
    is_similarity : bool
        Whether the closest match has the greatest value; False for a distance, which is least
        there.
    needs_range : bool
        Whether ``make`` takes ``data_range``, the least and the greatest entry of all sets.
    """

    label: str
    make: Callable[..., Block]
    is_similarity: bool = True
    needs_range: bool = False

    @property
    def sign(self) -> float:
        """1 for similarities, −1 for distances: what makes the greatest the closest."""
        return 1.0 if self.is_similarity else -1.0


INDICES: Registry[Index] = Registry(
    "dispersion index",
    {
        name: f"feeler.analysis.indices:{name.upper()}"
        for name in ("pearson", "ssim", "mse", "nmi")
    },
)
"""Every known index by its name; ``INDICES.register(name, Index(...))`` adds one."""


def check_tensors(tensors: Any, *, least: int = 2) -> np.ndarray:
    """Tensors or codes as a finite float array (trial, vector, time), a view if possible.

    Raises
    ------
    InvalidInput
        Not three dimensions of numbers (tensors of unequal shapes cannot form such an array), an
        empty dimension, fewer than ``least`` trials, or NaN or infinite entries.
    """
    tensors = stack_planes(tensors)
    if hasattr(tensors, "data_vars"):
        raise InvalidInput('expected one variable of a Dataset, as tensors["angle"]; got all.')
    refuse_masked(tensors)
    try:
        array = np.asarray(tensors, dtype=float)
    except (ValueError, TypeError, OverflowError) as error:
        raise InvalidInput(
            f"the tensors do not form one array (trial, sensor, time): {error}. They must all have"
            " the same number of sensors and samples; crop or pad them to a common length first."
        ) from None
    if array.ndim != 3 or 0 in array.shape:
        raise InvalidInput(
            f"expected tensors or codes (trial, vector, time), got shape {array.shape}."
        )
    if array.shape[0] < least:
        raise InvalidInput(
            f"{array.shape[0]} tensor(s) given, at least {least} are needed to compare them."
        )
    if not np.isfinite(array).all():
        bad = np.flatnonzero(~np.isfinite(array).all(axis=(1, 2)))
        raise InvalidInput(
            f"trial(s) {_name_trials(bad)} hold NaN or infinite entries; drop or repair them first."
        )
    return array


def iterate_blocks(n: int, block: int = BLOCK_SIZE) -> Iterator[tuple[slice, slice]]:
    """Slices (rows, columns) that cover the upper triangle of an n × n matrix."""
    if block < 1:
        raise InvalidInput(f"block must be ≥ 1 tensor, got {block}.")
    edges = [slice(start, min(start + block, n)) for start in range(0, n, block)]
    for k, rows in enumerate(edges):
        for columns in edges[k:]:
            yield rows, columns


def _compare_all(
    tensors: Any, name: str, make: Callable[..., Block], block: int = BLOCK_SIZE, **options: Any
) -> Any:
    """The symmetric matrix (trial, other) of an index; labelled where the tensors are."""
    array = check_tensors(tensors)
    compute, matrix = make(array, **options), np.empty((len(array), len(array)))
    for rows, columns in iterate_blocks(len(array), block):
        values = compute(rows, columns)
        matrix[rows, columns] = values
        matrix[columns, rows] = values.T
    return label_like(matrix, tensors, ("trial", "other"), name)


def _compare_blocks(
    prepare: Callable[[slice], tuple], kernel: Callable[..., np.ndarray], *given: Any
) -> Block:
    """Blocks (row, column) of what a compiled kernel gives for pairs of two prepared slices; a
    thread for each core.
    """

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = prepare(rows)
        b = a if rows == columns else prepare(columns)
        block = np.empty((rows.stop - rows.start, columns.stop - columns.start))
        # the upper triangle where both are the same
        found = np.triu_indices_from(block) if rows == columns else np.indices(block.shape)
        pairs = np.ascontiguousarray(np.reshape(found, (2, -1)).T)
        with ThreadExecutor(min(count_cores(), len(pairs))) as threads:
            parts = np.array_split(pairs, threads.workers)
            values = np.concatenate(
                [*threads.map(lambda part: kernel(*a, *b, part, *given), parts)]
            )
        block[pairs[:, 0], pairs[:, 1]] = values
        if rows == columns:
            block[pairs[:, 1], pairs[:, 0]] = values
        return block

    return compute


def _name_trials(indices: np.ndarray) -> str:
    """Positions for a message, the first eight."""
    shown = ", ".join(str(i) for i in indices[:8])
    return shown + (f" and {indices.size - 8} more" if indices.size > 8 else "")


# Pearson correlation of flattened tensors.


@checked
def compute_pearson(tensors: Any, *, block: int = BLOCK_SIZE) -> Any:
    """Pearson r between all pairs of tensors, over all sensors and samples.

    r_ab = Σ (a − ā)(b − b̄) / √(Σ (a − ā)² · Σ (b − b̄)²)

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) in [−1, 1], ones on the diagonal.

    Raises
    ------
    InvalidInput
        A constant tensor: its correlation is undefined.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    return _compare_all(tensors, "pearson", _make_pearson, block)


def _make_pearson(array: np.ndarray) -> Block:
    """Pearson r of two slices of a set; checks once that it is defined for all of them."""
    spread = np.array([np.ptp(tensor) for tensor in array])
    if (constant := np.flatnonzero(spread == 0)).size:
        raise InvalidInput(
            f"trial(s) {_name_trials(constant)} are constant (no contact, or all zero after"
            " rectifying), so their correlation is undefined. Leave them out, or use compute_mse"
            " or compute_nmi, which are defined for them."
        )

    def standardise(part: slice) -> np.ndarray:
        flat = array[part].reshape(part.stop - part.start, -1)
        # tiny angles squared must not underflow
        flat = flat / np.abs(flat).max(axis=1, keepdims=True)
        flat = flat - flat.mean(axis=1, keepdims=True)
        return flat / np.linalg.norm(flat, axis=1, keepdims=True)

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = standardise(rows)
        r = np.clip(a @ (a if rows == columns else standardise(columns)).T, -1.0, 1.0)
        if rows == columns:
            np.fill_diagonal(r, 1.0)
            r = (r + r.T) / 2
        return r

    return compute


PEARSON = Index(label="Pearson r", make=_make_pearson)


# Mean squared error between tensors.

# below this share of the two tensors' energy, a² + b² − 2ab has lost digits: subtract directly
_CANCELLATION = 1e-4


@checked
def compute_mse(tensors: Any, *, block: int = BLOCK_SIZE) -> Any:
    """Mean squared error between all pairs of tensors: mean over sensors and samples of (a − b)².

    The only index of the four that grows with dispersion, and the only one with a unit: that of the
    input, squared. Compare sets only after scaling them by one common factor (``scale_common``).

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) ≥ 0, zeros on the diagonal.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    return _compare_all(tensors, "mse", _make_mse, block)


def _make_mse(array: np.ndarray) -> Block:
    """Mean squared error of two slices of a set, by one matrix product.

    Pairs that are nearly identical are subtracted directly.
    """
    check_squares(array)
    size = array[0].size

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = array[rows].reshape(-1, size)
        b = array[columns].reshape(-1, size)
        energy = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None, :]
        difference = energy - 2.0 * (a @ b.T)
        for i, j in np.argwhere(difference <= _CANCELLATION * energy):
            difference[i, j] = ((a[i] - b[j]) ** 2).sum()
        return difference / size

    return compute


MSE = Index(label="MSE", make=_make_mse, is_similarity=False)


# Normalised mutual information (NMI) of binned tensors, for all pairs at once.

_N_BINS = 256  # [C] the paper does not define its NMI; 32, 64 and 100 are its sensitivity
_ZEROS = ("keep", "drop")


@checked
def compute_nmi(
    tensors: Any,
    *,
    n_bins: int = _N_BINS,
    data_range: tuple[float, float] | None = None,
    common_zeros: str = "keep",
    block: int = BLOCK_SIZE,
) -> Any:
    """Normalised mutual information between all pairs of tensors, entry against entry.

    NMI = 2 I(A; B) / (H(A) + H(B)), from the joint histogram over all sensors and samples, bins
    common to the set.

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    n_bins
        Equal bins over ``data_range``, 2–256.
    data_range
        Lowest and highest bin edge; default: the set's own least and greatest entry. Entries
        outside go to the end bins. Give one range when sets are to be compared.
    common_zeros
        ``keep``; or ``drop`` the entries where both tensors lie in the bin of zero: the common
        background, which otherwise dominates the index.
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) in [0, 1]. As in scikit-learn, two tensors that fill one bin each have NMI
    1, and one such tensor against a varied one 0.

    Raises
    ------
    InvalidInput
        ``n_bins`` outside 2–256, an empty range, or an unknown ``common_zeros``.

    Notes
    -----
    The paper names NMI without defining it; this definition is a choice [C].
    """
    return _compare_all(
        tensors,
        "nmi",
        _make_nmi,
        block,
        n_bins=n_bins,
        data_range=data_range,
        common_zeros=common_zeros,
    )


def _make_nmi(
    array: np.ndarray,
    *,
    n_bins: int = _N_BINS,
    data_range: tuple[float, float] | None = None,
    common_zeros: str = "keep",
) -> Block:
    """NMI of two slices of a set."""
    low, high = (array.min(), array.max()) if data_range is None else data_range
    if not 2 <= n_bins <= 256:
        raise InvalidInput(f"n_bins must be between 2 and 256, got {n_bins}.")
    if not low <= high:
        raise InvalidInput(f"data_range must run from low to high, got ({low}, {high}).")
    if common_zeros not in _ZEROS:
        raise InvalidInput(
            f"common_zeros must be one of {', '.join(_ZEROS)}, got {common_zeros!r}."
        )
    zero = (
        int(digitise(np.zeros(1), n_bins, low, high)[0])
        if common_zeros == "drop" and low <= 0 <= high
        else -1
    )
    size = array[0].size
    counts = np.arange(size + 1.0)
    self_information = counts * np.log(np.maximum(counts, 1.0))  # c log c, 0 at 0
    gain = np.diff(self_information)

    def prepare(part: slice) -> tuple[np.ndarray, np.ndarray]:
        levels = digitise(array[part].reshape(-1, size), n_bins, low, high)
        return levels, np.stack([np.bincount(row, minlength=n_bins) for row in levels])

    return _compare_blocks(prepare, _compare_pairs_nmi, self_information, gain, zero)


NMI = Index(label="NMI", make=_make_nmi, needs_range=True)


def digitise(values: np.ndarray, n_bins: int, low: float, high: float) -> np.ndarray:
    """Bin of each value, as bytes; values outside [low, high] go to the end bins."""
    if high <= low:
        return np.zeros(values.shape, dtype=np.uint8)
    scaled = np.floor((values - low) * (n_bins / (high - low)))
    return np.clip(scaled, 0, n_bins - 1).astype(np.uint8)


@compiled
def _compare_pairs_nmi(a, histogram_a, b, histogram_b, pairs, self_information, gain, zero):
    """NMI of each pair; entropies from Σ c log c over the cells, built up point by point."""
    values = np.empty(len(pairs))
    n_bins = histogram_a.shape[1]
    size = a.shape[1]
    joint = np.zeros((n_bins, n_bins), dtype=np.int32)
    for p in range(len(pairs)):
        i, j = pairs[p]
        joint[:] = 0
        together = 0.0
        for k in range(size):
            u, v = a[i, k], b[j, k]
            count = joint[u, v]
            together += gain[count]
            joint[u, v] = count + 1
        dropped = joint[zero, zero] if zero >= 0 else 0
        together -= self_information[dropped]
        alone_a, alone_b = 0.0, 0.0
        for level in range(n_bins):
            less = dropped if level == zero else 0
            alone_a += self_information[histogram_a[i, level] - less]
            alone_b += self_information[histogram_b[j, level] - less]
        values[p] = _normalise(together, alone_a, alone_b, size - dropped)
    return values


@compiled
def _normalise(together, alone_a, alone_b, n):
    """2 I / (H_A + H_B) of n points from the sums Σ c log c of the joint table and its margins."""
    if n == 0:
        return 1.0
    log_n = np.log(n)
    entropy_a, entropy_b = log_n - alone_a / n, log_n - alone_b / n
    if entropy_a + entropy_b <= 1e-12:
        return 1.0
    information = entropy_a + entropy_b - (log_n - together / n)
    return min(max(2.0 * information / (entropy_a + entropy_b), 0.0), 1.0)


# Structural similarity (SSIM), as MATLAB and scikit-image compute it, for all pairs at once.

_SIGMA = 1.5  # [B] MATLAB ssim's default Radius; Wang et al. 2004, doi:10.1109/TIP.2003.819861
_RADIUS = 5  # [B] window 11 × 11: ceil(3 · 1.5) in MATLAB, int(3.5 · 1.5 + 0.5) in scikit-image
_K1, _K2 = 0.01, 0.03  # [B] both libraries
_BORDERS: dict[str, Any] = {"replicate": "edge", "reflect": "symmetric", "interior": "edge"}


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
        text = (
            "the largest entry is far below data_range: SSIM's constants will swamp the signal and"
            " every pair will look alike. Scale the whole set first: scale_common(tensors)."
        )
        numbers = f"They are {largest:.3g} and {data_range:g}."
        warnings.warn(ModelValidityWarning(text, numbers), stacklevel=2)
    return _compare_all(
        tensors, "ssim", _make_ssim, block, data_range=data_range, border=border
    )


def _make_ssim(
    array: np.ndarray, *, data_range: float = 1.0, border: str = "replicate"
) -> Block:
    """SSIM of two slices of a set."""
    if border not in _BORDERS:
        raise InvalidInput(f"border must be one of {', '.join(_BORDERS)}, got {border!r}.")
    if not SQUARED[0] <= data_range <= SQUARED[1]:
        raise InvalidInput(
            f"data_range must be > 0, with a square that is a number, got {data_range}."
        )
    window = 2 * _RADIUS + 1
    if border == "interior" and min(array.shape[1:]) < window:
        raise InvalidInput(
            f"images of {array.shape[1]} × {array.shape[2]} are smaller than the {window} ×"
            f" {window} window. Use border='replicate'."
        )
    offset = np.arange(-_RADIUS, _RADIUS + 1)
    taps = np.exp(-0.5 * (offset / _SIGMA) ** 2)
    taps = taps / taps.sum()
    c1, c2 = (_K1 * data_range) ** 2, (_K2 * data_range) ** 2

    wide = (0 if border == "interior" else _RADIUS,) * 2

    def prepare(part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        images = np.ascontiguousarray(
            np.pad(array[part], ((0, 0), wide, wide), mode=_BORDERS[border])
        )
        mean, square = _filter_all(images, taps)
        return images, mean, square - mean**2

    return _compare_blocks(prepare, _compare_pairs, taps, c1, c2)


SSIM = Index(label="SSIM", make=_make_ssim)


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


@compiled
def _filter_all(images, taps):
    """Windowed mean and mean square of every image, (image, height − 10, width − 10) each."""
    n, height, width = images.shape
    mean = np.empty((n, height - 10, width - 10))
    square = np.empty_like(mean)
    column = np.empty(width)
    for k in range(n):
        _filter(images[k], taps, column, mean[k])
        _filter(images[k] * images[k], taps, column, square[k])
    return mean, square


@compiled
def _compare_pairs(a, mean_a, variance_a, b, mean_b, variance_b, pairs, taps, c1, c2):
    """Mean SSIM of each pair (row of a, row of b)."""
    values = np.empty(len(pairs))
    height, width = a.shape[1:]
    column = np.empty(width)
    product = np.empty((height, width))
    cross = np.empty((height - 10, width - 10))
    for p in range(len(pairs)):
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
