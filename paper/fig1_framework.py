"""Fig. 1D as a drawing: what this report does, from the animal's numbers to the answers."""

from matplotlib.axes import Axes

from feeler.antenna.segments import Antenna
from feeler.report.page import Section
from paper.context import Context

_BOX = {"boxstyle": "round,pad=0.35", "lw": 0.8}
_GIVEN, _MADE = {"fc": "#EEEEEE", "ec": "#888888"}, {"fc": "#FFFFFF", "ec": "#000000"}


def plot(antenna: Antenna, ax: Axes) -> None:
    """Boxes from left to right; grey: taken from the paper, white: computed here."""
    model = f"model antenna\n{antenna.n_segments} segments,\n{antenna.sensors.size} sensors"
    boxes = {
        "animal": (0.09, 0.84, "the animal's\npublished\nnumbers", _GIVEN),
        "device": (0.09, 0.16, "the robot's\npublished\nnumbers", _GIVEN),
        "model": (0.29, 0.84, model, _MADE),
        "touches": (0.29, 0.5, "touches\nobject, place,\nspeed", _MADE),
        "robots": (0.29, 0.16, "robot's model and\nsurrogate robots\n8 joints", _MADE),
        "tensors": (0.5, 0.5, "tactile tensors\nsensor × time", _MADE),
        "alike": (0.72, 0.84, "how alike?\ndispersion", _MADE),
        "code": (0.72, 0.5, "code\nbases, activations", _MADE),
        "readers": (0.72, 0.16, "classifiers and\nideal observers", _MADE),
        "answer": (0.92, 0.16, "answers\nwhich object?\nwhere?", _MADE),
    }
    arrows = (
        *(
            "animal model",
            "device robots",
            "model tensors",
            "touches tensors",
            "robots tensors",
        ),
        *("tensors alike", "tensors code", "tensors readers", "code readers", "readers answer"),
    )
    drawn = {name: _draw_box(*box, ax) for name, box in boxes.items()}
    for arrow in arrows:
        start, end = (drawn[name] for name in arrow.split())
        ax.annotate(
            "",
            xy=end.get_position(),
            xytext=start.get_position(),
            arrowprops={
                "arrowstyle": "->",
                "lw": 0.8,
                "patchA": start.get_bbox_patch(),
                "patchB": end.get_bbox_patch(),
            },
        )
    ax.set(xlim=(0, 1), ylim=(0, 1))
    ax.axis("off")


def _draw_box(x: float, y: float, words: str, colours: dict[str, str], ax: Axes):
    return ax.text(x, y, words, ha="center", va="center", bbox=_BOX | colours, zorder=3)


def show(context: Context, section: Section) -> None:
    """The way of this report."""
    if not context.is_cockroach:
        return  # it begins with the animal
    section.figure(
        "fig1_framework",
        "The way of this report. Grey: taken from the paper; white: computed here. The paper's own"
        " robot is not here: surrogate robots stand for it. (Fig. 1D)",
        lambda figure: plot(context.antenna, figure.subplots()),
        height=2.4,
        numbers={
            "segments": context.antenna.n_segments,
            "sensors": context.antenna.sensors.size,
        },
    )
