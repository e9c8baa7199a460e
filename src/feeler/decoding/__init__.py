"""Decoding: classifiers, noise, honest splits. Arrays in, numbers out; no simulator needed."""

from feeler.decoding.classifiers import make_lda, make_svm
from feeler.decoding.codes import CODES, encode_with, make_codes, make_null
from feeler.decoding.components import PrincipalComponents
from feeler.decoding.confusion import Confused, explain_confusion
from feeler.decoding.curves import PeakEncoder
from feeler.decoding.decoder import StreamDecoder
from feeler.decoding.groups import group_tensors, list_groups
from feeler.decoding.labels import make_labels
from feeler.decoding.reader import READERS, Reader, measure_reader
from feeler.decoding.splits import (
    compute_jittered,
    compute_left_out,
    iterate_left_out,
)
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.decoding.told import IdealReader, TemplateReader
from feeler.task.noise import NOISES, Common, Noise, Relative

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
