"""Whether the gradient wins where contact leaves the plane, and where sensors must sit around the
antenna (no figure of the paper).
"""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.plotting.results import plot_spreads
from feeler.plotting.style import PALETTE
from feeler.report import Section
from paper.context import Context
from studies.spikes.found import average, find_least, say_mean
from studies.stored import load_stored, read_declared

_Cells = Mapping[str, Any]
"""By "kind/antenna" the accuracy (set, classifier, layout)."""

FEW = ("both planes", "one side")
"""Layouts that are asked of all antennas; the others only of the published one, in space."""
_PUBLISHED = "exponential"
_OTHERS = ("linear", "uniform", "matched")
_MARKS = {"templates": ("o", PALETTE[0]), "lda": ("s", PALETTE[1])}
_READ_BY = {"templates": "normal distributions with scatter", "lda": "LDA"}


class _Found:
    """Percent classified correctly, one number for each set."""

    def __init__(self, cells: _Cells, layouts: list[str], classifiers: list[str]) -> None:
        self.cells, self.layouts, self.classifiers = cells, layouts, classifiers

    def get(
        self,
        layout: str = FEW[0],
        classifier: str = "templates",
        antenna: str = _PUBLISHED,
        kind: str = "space",
    ) -> np.ndarray:
        """Of one antenna, layout and classifier."""
        own = np.asarray(self.cells[f"{kind}/{antenna}"], dtype=float)
        return 100 * own[:, self.classifiers.index(classifier), self.layouts.index(layout)]

    def gain(self, better: Mapping[str, str], worse: Mapping[str, str]) -> dict[str, Any]:
        """Points between two, in pairs over the sets."""
        return average(self.get(**better) - self.get(**worse))

    def win(self, **asked: str) -> dict[str, Any]:
        """By how much the published antenna is ahead of the other that is nearest."""
        return find_least([self.gain(asked, asked | {"antenna": name}) for name in _OTHERS])


def collect_values(cells: _Cells) -> dict[str, Any]:
    """The numbers that claims are held against, and percent classified correctly of all that
    was asked.
    """
    asked = read_declared("space")
    found = _Found(cells, [*asked["layouts"]], asked["classifiers"]["names"])
    one_way = "one-way, {}".format
    alone = [{"layout": one_way(side)} for side in ("one side", "opposite side")]
    around = {"layout": one_way("three sides")}
    values: dict[str, Any] = {
        "space.gradient": found.win(),
        "space.gradient.lda": found.win(classifier="lda"),
        "space.gradient.side": found.win(layout="one side"),
        "space.cost": found.gain({"kind": "plane"}, {}),
        "space.turned": found.gain({"layout": "quarter turns"}, {"layout": "one side"}),
        "space.turned.lda": found.gain(
            {"layout": "quarter turns", "classifier": "lda"},
            {"layout": "one side", "classifier": "lda"},
        ),
        "space.one_way": find_least([found.gain(around, side) for side in alone]),
        "space.sets": len(found.get()),
    }
    for place, classifier in product(cells, found.classifiers):
        kind, name = place.split("/")
        for layout in found.layouts if place == f"space/{_PUBLISHED}" else FEW:
            named = average(found.get(layout, classifier, name, kind))
            values[_name(kind, name, classifier, layout)] = named
    return values


def plot(cells: _Cells, figure: Figure) -> None:
    """Classified correctly by antenna, and of the published one by where sensors sit."""
    values = collect_values(cells)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.5))
    names, layouts = (_PUBLISHED, *_OTHERS), [*read_declared("space")["layouts"]]
    for classifier, (mark, colour) in _MARKS.items():
        style: dict[str, Any] = {"fmt": mark, "ms": 4, "capsize": 2, "color": colour}
        for layout, fill, aside in zip(FEW, (colour, "none"), (-0.1, 0.1), strict=True):
            spreads = [values[_name("space", name, classifier, layout)] for name in names]
            at, label = np.arange(len(names)) + aside, f"{classifier}, {layout}"
            plot_spreads(left, at, spreads, label=label, mfc=fill, **style)
        spreads = [values[_name("space", _PUBLISHED, classifier, layout)] for layout in layouts]
        plot_spreads(
            right, range(len(layouts)), spreads, across=True, label=classifier, **style
        )
    left.set_xticks(range(len(names)), names, rotation=20)
    left.set(ylabel="accuracy [%]", xlim=(-0.5, len(names) - 0.5), ylim=(0, 104))
    right.set_yticks(range(len(layouts)), layouts)
    right.invert_yaxis()
    right.set(xlabel="accuracy of the published antenna [%]", xlim=(0, 104))
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)


def _name(kind: str, antenna: str, classifier: str, layout: str) -> str:
    where = layout.replace(",", "").replace(" ", "_")
    return f"space.right.{kind}.{antenna}.{classifier}.{where}"


def show(_context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    cells, said = load_stored("space")
    values, asked = collect_values(cells), read_declared("space")
    section.text(
        "Antennae bend in space, and what they meet comes from anywhere. Balls of four sizes touch"
        " antennae that bend alike in two planes at five places, from a direction that is drawn"
        " within ± 60 degrees around the antenna and that nobody is told. Which of the twenty was"
        " it? Classifiers learn six touches of each and are asked about six others, by what sensors"
        " feel that sit on one side of the antenna, on two, or around it. Every choice and every"
        " expectation was written down before (studies/space/declared.toml)."
    )
    section.text(
        f"{said} {values['space.sets']} sets of touches, of at most {asked['sets']}: the clock"
        " ended the run."
    )
    section.figure(
        "space",
        "Accuracy, twenty classes. a: by antenna; open marks: sensors on one side only. b: the"
        " published antenna by where its sensors sit. Bars: 95 % CI over"
        f" {values['space.sets']} sets of resampled touches.",
        lambda figure: plot(cells, figure),
        height=4.2,
        numbers={name: one["value"] for name, one in values.items() if isinstance(one, dict)},
    )
    rows = [
        [
            kind,
            name,
            *(say_mean(values[_name(kind, name, *told)]) for told in product(_MARKS, FEW)),
        ]
        for kind, name in (place.split("/") for place in cells)
    ]
    header = [f"{classifier}, {layout}" for classifier, layout in product(_MARKS, FEW)]
    section.table(
        ["touches", "antenna", *header], rows, "Classified correctly [%], 95 % over sets."
    )
    rows = [
        [
            layout,
            *(
                say_mean(values[_name("space", _PUBLISHED, classifier, layout)])
                for classifier in _MARKS
            ),
        ]
        for layout in asked["layouts"]
    ]
    section.table(
        ["sensors", *(_READ_BY[classifier] for classifier in _MARKS)],
        rows,
        "The published antenna, touches within ± 60 degrees: classified correctly [%], 95 %"
        " over sets.",
    )
    section.values.update(values)
