"""Every figure and movie of the paper, and where it stands in the report."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Place:
    """One figure of the paper; ``prefix`` begins the names of ours."""

    name: str
    shows: str
    prefix: str = ""
    note: str = ""


def _place(name: str, shows: str, prefix: str = "", note: str = "") -> Place:
    return Place(name=name, shows=shows, prefix=prefix, note=note)


PLACES = (
    _place("Fig. 1", "the idea, in drawings", note="a drawing; nothing to compute"),
    _place("Fig. 2A, C", "the model antenna", "fig2c"),
    _place(
        "Fig. 2B",
        "step and impulse response",
        "fig2b",
        "against digitised mean traces; the animals' raw data were not published",
    ),
    _place("Fig. 2D", "features and locations", "fig2d"),
    _place("Fig. 2E", "tactile tensors", "fig2e"),
    _place("Fig. 3A–D", "wall distance", "fig3", "simulation only; the animal's curvature points were not published"),
    _place(
        "Fig. 4A", "the pipeline, as a drawing", note="a drawing; the guide page on encoding shows each step on data"
    ),
    _place("Fig. 4B–D", "encoding by rank, bases, activations", "fig4"),
    _place("Fig. 5A–E", "dispersion and classification", "fig5"),
    _place("Fig. 5F–G", "bases and entropies by profile", "fig5f"),
    _place("Fig. 6A–E", "the robot", "fig6", "simulation and a surrogate robot; the recordings were not published"),
    _place("Fig. S1", "segment lengths", "figS1", "synthetic lengths; the measured ones were not published"),
    _place("Fig. S2", "active touch speed", "figS2", "synthetic tracks; the animal's were not published"),
    _place("Fig. S3", "slow tensors of all profiles", "figS3"),
    _place("Fig. S4", "convolutional network", "figS4", "needs torch: make reproduce SCALE=paper"),
    _place("Fig. S5", "bases by duration", "figS5"),
    _place("Fig. S6", "dispersion by four indices", "figS6"),
    _place("Fig. S7", "robot and simulation tensors", "figS7", "surrogate robot"),
    _place("Movie S1", "impulse response", "movieS1", "simulation; the animal's film was not published as data"),
    _place("Movie S2", "a tensor grows", "movieS2"),
    _place("Movie S3", "wall following", "movieS3"),
    _place("Movie S4", "robot's impulse response", "movieS4", "simulation and surrogate"),
)
