"""The whole paper, top to bottom: an antenna is touched; a touch becomes a tensor, a code, an answer."""

from collections.abc import Callable

from feeler.paper import sections
from feeler.paper.claims import judge_claims
from feeler.paper.context import Context
from feeler.paper.report import write_report
from feeler.paper.section import Section
from feeler.paper.stage import Stage, run_stage

STAGES = (
    Stage(name="antenna", title="The antenna", make=sections.antenna.make, rooms=("paper",)),
    Stage(
        name="calibration",
        title="Calibration: does the model move like the animal?",
        make=sections.calibration.make,
        rooms=("response", "calibration", "paper"),
    ),
    Stage(name="tensors", title="Tactile tensors", make=sections.tensors.make, rooms=("paper",)),
    Stage(name="wall", title="Wall distance", make=sections.wall.make, rooms=("wall", "paper")),
    Stage(name="encoding", title="Encoding", make=sections.encoding.make, rooms=("encoding", "paper")),
    Stage(
        name="reading",
        title="Dispersion and classification",
        make=sections.reading.make,
        rooms=("encoding", "dispersion", "decoding", "paper"),
    ),
    Stage(name="cnn", title="Convolutional network", make=sections.cnn.make, rooms=("decoding", "paper")),
    Stage(
        name="robot",
        title="The robotic antenna",
        make=sections.robot.make,
        rooms=("robot", "decoding", "calibration", "response", "encoding", "dispersion", "paper"),
    ),
    Stage(name="tracking", title="Active touch speed", make=sections.tracking.make, rooms=("tracking", "paper")),
)

COCKROACH_ONLY = ("calibration", "robot", "tracking")


def reproduce(context: Context, started: Callable[[str], None] = lambda title: None) -> list[Section]:
    """Run every stage, judge every claim, write ``report.html`` and ``figures.pdf``; returns the sections.

    ``started(title)`` is called before each stage. For another antenna the sections that speak of the animal's or the
    robot's own data are left out, with a word why.
    """
    made = []
    for stage in STAGES:
        started(stage.title)
        if not context.is_cockroach and stage.name in COCKROACH_ONLY:
            made.append(_leave_out(stage, context))
        else:
            made.append(run_stage(stage, context))
    claims = judge_claims(made, context)
    write_report(context, made, claims)
    return made


def _leave_out(stage: Stage, context: Context) -> Section:
    section = Section(name=stage.name, title=stage.title, folder=context.out)
    section.text("Left out: this section compares with measurements of the cockroach or of the paper's robot.")
    return section
