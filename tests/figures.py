"""The standard of figures: letters that can be read, no text on text, no legend on what is drawn,
named colours with one meaning each, units.
"""

import re
from collections import defaultdict

import numpy as np
from matplotlib.colors import to_hex

from feeler.plotting.style import (
    BASIS_COLOURS,
    FEATURE_COLOURS,
    LEAST,
    NOISE_COLOURS,
    PROFILE_COLOURS,
    pick_shades,
)

MEASURED = re.compile(
    r"\b(time|angle|speed|distance|force|frequency|length|stiffness|damping|curvature|accuracy)\b"
)
WITHOUT = re.compile(r"\[|\b(share|times|ratio|relative|sample)\b")  # a unit, or a bare number
OWN = {
    **{name: {to_hex(colour)} for name, colour in (PROFILE_COLOURS | FEATURE_COLOURS).items()},
    **{f"{name} noise": {to_hex(colour)} for name, colour in NOISE_COLOURS.items()},
    **{f"basis {k}": {to_hex(colour)} for k, colour in enumerate(BASIS_COLOURS, 1)},
    "a speed": {to_hex(shade) for n in range(1, 9) for shade in pick_shades("speed", n)},
}
"""The colours of what has its own in every figure."""


def find_meaning(name):
    """What a name in a figure means: which thing with a colour of its own, or its first word."""
    if re.match(r"(slow|medium|fast)\b(?!-)|[\d.]+ m/s", name):
        return "a speed"
    if re.match(r"\w+ at [\d.]+", name):
        return name  # one of several answers, not every touch of that object
    first = re.match(r"basis \d+|\w+|", name)[0]
    return f"{first} noise" if first in NOISE_COLOURS else first


def find_mixed(named):
    """Colours with two meanings, and what is not drawn in the colour of its own, from the names of
    a figure with their colours.
    """
    meanings = defaultdict(set)
    for name, colours in named.items():
        for colour in colours:
            meanings[colour].add(find_meaning(name))
    faults = [f"{c} means {sorted(found)}" for c, found in meanings.items() if len(found) > 1]
    for colour, meaning in ((c, meaning) for c, found in meanings.items() for meaning in found):
        owners = sorted(owner for owner, own in OWN.items() if colour in own)
        if meaning in OWN and meaning not in owners:
            faults.append(f"{meaning!r} is drawn in {colour}, not in its own")
        elif owners and meaning not in owners:
            faults.append(f"{meaning!r} is drawn in the colour of {owners}")
    return faults


def find_faults(figure, words):
    """What a reader could not read, from the figure and from what was measured on its words."""
    faults = [f"letters of {words['least']} pt"] if words["least"] < LEAST else []
    faults += [f"{a!r} stands on {b!r}" for a, b in words["over"]]
    faults += [f"the legend of {first!r} lies on what is drawn" for first in words["covered"]]
    faults += find_mixed(words["named"])
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
