"""Decoding: classifiers, noise, honest splits. Arrays in, numbers out; no simulator needed."""

from feeler.decoding.classifiers import (
    CLASSIFIERS,
    Classifier,
    PrincipalComponents,
    make_labels,
    make_lda,
    measure_classifier,
)
from feeler.decoding.curves import (
    CODES,
    PeakEncoder,
    encode_with,
    group_tensors,
    list_groups,
    make_codes,
    make_null,
)
from feeler.decoding.observers import IdealObserver, TemplateClassifier
from feeler.decoding.streams import StreamDecoder
from feeler.decoding.sweeps import (
    Sweep,
    compute_jittered,
    compute_left_out,
    compute_sweep,
    explain_confusion,
)
from feeler.objects.noise import NOISES, Common, Noise, Relative
from feeler.renamed import find_renamed

__all__ = [
    "CLASSIFIERS",
    "CODES",
    "NOISES",
    "Classifier",
    "Common",
    "IdealObserver",
    "Noise",
    "PeakEncoder",
    "PrincipalComponents",
    "Relative",
    "StreamDecoder",
    "Sweep",
    "TemplateClassifier",
    "compute_jittered",
    "compute_left_out",
    "compute_sweep",
    "encode_with",
    "explain_confusion",
    "group_tensors",
    "list_groups",
    "make_codes",
    "make_labels",
    "make_lda",
    "make_null",
    "measure_classifier",
]

__getattr__ = find_renamed(__name__)
__dir__ = __all__.copy
