"""The whole paper, top to bottom: an antenna is touched; a touch becomes a tensor, a code, an
answer.
"""

import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace

from feeler.errors import say_warnings
from feeler.execute import ProcessExecutor, run_batch
from feeler.execute.workers import check_workers
from feeler.report import Section
from paper import inputs, readings_page
from paper.cache import SOURCES, Stage, find_kept, list_sources, run_stage
from paper.context import Context
from paper.kept import find_shipped
from paper.report import write_page, write_report
from paper.statements import judge_statements

STAGES = (
    Stage(
        name="front",
        title="Which touch was it? Accuracy against noise",
        figures=("front",),
        reads=("scale", "engine", "timestep", "antenna"),
    ),
    Stage(
        name="antenna",
        title="The antenna",
        figures=("fig2:antenna",),
        reads=("antenna",),
    ),
    Stage(
        name="calibration",
        title="Calibration: does the model move like the animal?",
        figures=("fig2", "fig2:lengths", "fig2:fit"),
        reads=("scale", "seed", "engine", "antenna"),
    ),
    Stage(
        name="tensors",
        title="Tactile tensors",
        figures=(
            *("fig1:touch", "fig1:conditions", "fig2e:stimuli"),
            *("fig2e", "fig2e:contacts", "fig2e:movie"),
        ),
    ),
    Stage(
        name="axes",
        title="Design axes: spacing, sampling, compliance",
        figures=("fig1",),
    ),
    Stage(
        name="wall",
        title="Wall distance",
        figures=("fig1:animal", "fig3", "fig3:family", "paper.readings_computed"),
        reads=("scale", "engine", "antenna"),
    ),
    Stage(
        name="encoding",
        title="Encoding",
        figures=(
            *("fig4:encoder", "fig4", "fig5f", "fig5f:durations"),
            "paper.readings_computed",
        ),
    ),
    Stage(
        name="reading",
        title="Dispersion and classification",
        figures=(
            *("fig5:dispersion", "fig5", "fig5_data:nulls", "fig5_data:complete"),
            *("fig5_data:speeds", "fig5_sparse", "fig5_sparse:bending"),
            *("fig5_data:codes", "fig5:new", "paper.readings_computed"),
        ),
    ),
    Stage(
        name="cnn",
        title="Convolutional network",
        figures=("figS4",),
    ),
    Stage(
        name="tradeoff",
        title="Beyond the paper: speed against accuracy against energy",
        figures=("studies.speed.section", "studies.active.section"),
    ),
    Stage(
        name="gradient",
        title="Beyond the paper: what the gradient does",
        figures=("studies.gradient.section",),
        reads=("scale", "engine", "timestep", "antenna"),
    ),
    Stage(
        name="receptor",
        title="Beyond the paper: which receptor noise makes the gradient best",
        figures=("studies.receptor.section",),
        reads=("scale", "engine", "timestep", "antenna"),
    ),
    Stage(
        name="amplitude",
        title="Beyond the paper: amplitude or geometry",
        figures=("studies.amplitude.section",),
        reads=("antenna",),
    ),
    Stage(
        name="bounds",
        title="Beyond the paper: place, size and speed beside their bounds",
        figures=("studies.bounds.section",),
        reads=("scale", "engine", "timestep", "antenna"),
    ),
    Stage(
        name="design",
        title="Beyond the paper: which antenna tells most",
        figures=("studies.design.section",),
        reads=("antenna",),
    ),
    Stage(
        name="unseen",
        title="Beyond the paper: an antenna designed for held-out sizes and locations",
        figures=("studies.unseen.section",),
        reads=("antenna",),
    ),
    Stage(
        name="spikes",
        title="Beyond the paper: what a nerve says",
        figures=("studies.spikes.section",),
        reads=("antenna",),
    ),
    Stage(
        name="space",
        title="Beyond the paper: touched from out of the plane",
        figures=("studies.space.section",),
        reads=("antenna",),
    ),
    Stage(
        name="robot",
        title="The robotic antenna",
        figures=("fig6", "fig6:groups", "fig6:contacts"),
        reads=("scale", "seed", "engine"),
    ),
    Stage(
        name="tracking",
        title="Active touch speed",
        figures=("figS2",),
        reads=("seed", "antenna"),
    ),
)

_OFTEN = 30.0  # s between two pages while sections are made
_SAID: set[str] = set()  # kinds of warning that this process has printed
_COCKROACH_ONLY = (
    *("calibration", "receptor", "amplitude", "design"),
    *("unseen", "spikes", "space", "robot", "tracking"),
)


def reproduce(
    context: Context, report: Callable[[str, Section | None], None] = lambda *_: None
) -> list[Section]:
    """Run every stage, judge every statement, write ``report.html`` and ``results.csv``; returns
    the sections.

    Stages run side by side in ``context.workers`` processes (default one per core); the numbers do
    not depend on it. ``report(title, section)`` is called when a stage starts (section None) and
    when its section is there. What this scale does not compute is shown from the kept run; as long
    as a section is being made its kept one stands on the page, which is written anew at most
    every half minute. For another antenna the sections that speak of the animal's or the robot's
    own data are left out, with a word why.
    """
    context.out.mkdir(parents=True, exist_ok=True)
    shipped = {s.name: section for s in STAGES if (section := find_shipped(s, context))}
    made = {name: shipped[name] for name in context.effort.kept if name in shipped}
    made |= {s.name: section for s in STAGES if (section := find_kept(s, context))}
    if not context.is_cockroach:
        made |= {s.name: _leave_out(s, context) for s in STAGES if s.name in _COCKROACH_ONLY}
    for section in made.values():
        report(section.title, section)
    todo = sorted(
        (s for s in STAGES if s.name not in made),
        key=lambda s: context.effort.queue.index(s.name),
    )
    waiting = {s.name: replace(shipped[s.name], waits=True) for s in todo if s.name in shipped}
    if todo:
        _write_meanwhile(context, waiting | made)
    written = time.monotonic()
    for section in _run_stages(todo, context, report):
        made[section.name] = section
        if len(made) < len(STAGES) and time.monotonic() > written + _OFTEN:
            _write_meanwhile(context, waiting | made)
            written = time.monotonic()
    ordered = [made[stage.name] for stage in STAGES]
    if context.inputs:
        ordered.append(inputs.make_section(context.inputs, context))
    judged = judge_statements(ordered, context)
    if context.is_cockroach:
        ordered.append(readings_page.make_section(ordered, context))
    write_report(context, ordered, judged)
    list_sources(ordered).to_csv(context.out / SOURCES, index=False)
    return ordered


def _write_meanwhile(context: Context, found: dict[str, Section]) -> None:
    """The page as far as it is known, where kept sections have something to show."""
    ordered = [found[stage.name] for stage in STAGES if stage.name in found]
    if any(section.kept for section in ordered):
        write_page(context, ordered, judge_statements(ordered, context))


def _run_stages(stages: list[Stage], context: Context, report: Callable) -> Iterator[Section]:
    """Sections as they are ready; the first error is raised when the other stages are done and
    kept.
    """
    workers = min(check_workers(context.workers), len(stages))
    if workers <= 1:
        for stage in stages:
            report(stage.title, None)
            yield (section := run_stage(stage, context))
            report(stage.title, section)
        return

    def tasks() -> Iterator[tuple[int, tuple[Stage, Context]]]:
        for number, stage in enumerate(stages):
            report(stage.title, None)
            yield number, (stage, replace(context, progress=None))

    failed = []
    with ProcessExecutor(workers) as executor:
        for outcome in run_batch(_run_task, tasks(), executor=executor, window=workers + 1):
            if outcome.error:
                failed.append(outcome.error)
            else:
                report(stages[outcome.index].title, outcome.value)
                yield outcome.value
    if failed:
        raise failed[0]


def _run_task(task: tuple[Stage, Context]) -> Section:
    with warnings.catch_warnings():
        say_warnings(_SAID)
        return run_stage(*task)


def _leave_out(stage: Stage, context: Context) -> Section:
    section = Section(name=stage.name, title=stage.title, folder=context.out)
    section.text(
        "Left out: this section compares with measurements of the cockroach or of the paper's"
        " robot."
    )
    return section
