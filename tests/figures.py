"""The standard of figures: letters that can be read, no text on text, named colours, units."""

import re

import numpy as np
from matplotlib.colors import to_hex

from feeler.plotting.words import LEAST

MEASURED = re.compile(
    r"\b(time|angle|speed|distance|force|frequency|length|stiffness|damping|curvature|accuracy)\b"
)
WITHOUT = re.compile(r"\[|\b(share|times|ratio|relative|sample)\b")  # a unit, or a bare number


def find_faults(figure, words):
    """What a reader could not read, from the figure and from what was measured on its words."""
    faults = [f"letters of {words['least']} pt"] if words["least"] < LEAST else []
    faults += [f"{a!r} stands on {b!r}" for a, b in words["over"]]
    bars = [bar for ax in figure.axes if (bar := getattr(ax, "_colorbar", None))]
    named = {to_hex(colour) for bar in bars for colour in bar.cmap(np.arange(bar.cmap.N))}
    faults += [
        f"unnamed in {panel!r}: {lost}"
        for panel, colours in words["unnamed"].items()
        if (lost := sorted({*colours} - named))
    ]
    labels = {text for ax in figure.axes for text in (ax.get_xlabel(), ax.get_ylabel())}
    return faults + [
        f"without a unit: {text!r}"
        for text in sorted(labels)
        if MEASURED.search(text) and not WITHOUT.search(text)
    ]
