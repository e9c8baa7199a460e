"""Tensors become codes: convolutive NMF with exact sparseness, and measures of what it finds."""

from feeler.encoding.code import encode
from feeler.encoding.convolution import (
    compute_basis_similarity,
    compute_stability,
    locate_components,
    match_components,
    reconstruct,
)
from feeler.encoding.inputs import LABELS
from feeler.encoding.measures import (
    LocationMapping,
    compute_entropies,
    compute_histogram_entropy,
    compute_mass_entropy,
    hoyer_sparseness,
    map_locations,
    project_to_sparseness,
)
from feeler.encoding.model import ConvolutiveNMF, Flatten, load_encoder, save_encoder
from feeler.encoding.selection import (
    Selection,
    compute_dissimilarity,
    compute_significance,
    select_encoder,
)

__all__ = [
    "LABELS",
    "ConvolutiveNMF",
    "Flatten",
    "LocationMapping",
    "Selection",
    "compute_basis_similarity",
    "compute_dissimilarity",
    "compute_entropies",
    "compute_histogram_entropy",
    "compute_mass_entropy",
    "compute_significance",
    "compute_stability",
    "encode",
    "hoyer_sparseness",
    "load_encoder",
    "locate_components",
    "map_locations",
    "match_components",
    "project_to_sparseness",
    "reconstruct",
    "save_encoder",
    "select_encoder",
]

__dir__ = __all__.copy
