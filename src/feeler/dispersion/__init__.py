"""Dispersion: how far apart the tensors of a set lie. No simulator needed."""

from feeler.dispersion.closest import Closest, find_closest, search_closest
from feeler.dispersion.dispersion import Dispersion, compute_dispersion
from feeler.dispersion.index import INDICES, Index
from feeler.dispersion.interval import Interval, bootstrap_difference, bootstrap_mean
from feeler.dispersion.mse import compute_mse
from feeler.dispersion.nmi import compute_nmi
from feeler.dispersion.pearson import compute_pearson
from feeler.dispersion.ssim import compute_ssim
from feeler.tensors.scaling import scale_common

__all__ = [
    "INDICES",
    "Closest",
    "Dispersion",
    "Index",
    "Interval",
    "bootstrap_difference",
    "bootstrap_mean",
    "compute_dispersion",
    "compute_mse",
    "compute_nmi",
    "compute_pearson",
    "compute_ssim",
    "find_closest",
    "scale_common",
    "search_closest",
]
