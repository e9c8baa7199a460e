"""Decoding: classifiers, noise, honest splits. Arrays in, numbers out; no simulator needed."""

from feeler.decoding.classifiers import (
    READERS,
    PrincipalComponents,
    Reader,
    make_labels,
    make_lda,
    make_svm,
    measure_reader,
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
from feeler.decoding.observers import IdealReader, TemplateReader
from feeler.decoding.streams import StreamDecoder
from feeler.decoding.sweeps import (
    Confused,
    Sweep,
    compute_jittered,
    compute_left_out,
    compute_sweep,
    explain_confusion,
    iterate_left_out,
)
from feeler.objects.noise import NOISES, Common, Noise, Relative

__all__ = [
    "CODES",
    "NOISES",
    "READERS",
    "Common",
    "Confused",
    "IdealReader",
    "Noise",
    "PeakEncoder",
    "PrincipalComponents",
    "Reader",
    "Relative",
    "StreamDecoder",
    "Sweep",
    "TemplateReader",
    "compute_jittered",
    "compute_left_out",
    "compute_sweep",
    "encode_with",
    "explain_confusion",
    "group_tensors",
    "iterate_left_out",
    "list_groups",
    "make_codes",
    "make_labels",
    "make_lda",
    "make_null",
    "make_svm",
    "measure_reader",
]

__dir__ = __all__.copy
