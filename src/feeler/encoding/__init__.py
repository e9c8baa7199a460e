"""Tensors become codes: convolutive NMF with exact sparseness, and measures of its bases and activations."""

from feeler.encoding.bases import compute_basis_similarity, compute_stability, locate_components, match_components
from feeler.encoding.code import encode
from feeler.encoding.convolution import reconstruct
from feeler.encoding.model import ConvolutiveNMF
from feeler.encoding.sparseness import hoyer_sparseness, project_to_sparseness

__all__ = [
    "ConvolutiveNMF",
    "compute_basis_similarity",
    "compute_stability",
    "encode",
    "hoyer_sparseness",
    "locate_components",
    "match_components",
    "project_to_sparseness",
    "reconstruct",
]
