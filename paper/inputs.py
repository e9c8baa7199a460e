"""What the paper does not publish, where its authors give it in a file like inputs.toml: numbers
that turn "cannot be compared" into verdicts.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from feeler.antenna.animals import fit_sigmoid
from feeler.calibration import Problem, Protocol, load_targets, make_hinges
from feeler.decoding.transfer import LABEL_PARTS, TransferClassifier, score_transfer
from feeler.errors import InvalidInput
from feeler.files import parse_toml
from feeler.report import Section, make_spread
from feeler.robot.classify import align_recordings, make_training
from feeler.robot.recordings import load_recording
from paper.context import Context
from paper.fig2 import PAPER_P

_KHZ = {"frequency": 1e-3}  # Hz → kHz
_KNOWN = {
    "table_1": ("frequency", "damping_ratio", "ratio_71", "ratio_86"),
    "segments": ("lengths",),
    "exploration": ("angular_speed",),
    "robot": ("contacts",),
}
_CONTACT = {"file", *LABEL_PARTS}


def read_inputs(path: Path) -> dict[str, dict[str, Any]]:
    """The inputs that are filled in, by table.

    Raises
    ------
    InvalidInput
        No such file, or a table or an entry that is unknown.
    """
    if not path.is_file():
        raise InvalidInput(f"--inputs: there is no file {str(path)!r}; copy paper/inputs.toml.")
    found = parse_toml(path.read_text(encoding="utf-8"), str(path))
    for table, content in found.items():
        if table not in _KNOWN or (wrong := {*content} - {*_KNOWN[table]}):
            name = f"[{table}]" if table not in _KNOWN else f"[{table}] {min(wrong)}"
            known = "; ".join(f"[{t}] {', '.join(names)}" for t, names in _KNOWN.items())
            raise InvalidInput(f"{path} has no input {name}; there are: {known}.")
    return found


def compute(inputs: Mapping[str, Mapping[str, Any]], context: Context, folder: Path) -> dict:
    """Values by name: the model's targets as shares of Table 1's, cost and symmetric accuracy at
    the published constants, the sigmoid's residual, the mean speed, and the share of the real
    contacts that a classifier trained in simulation gets right (95 % interval of a binomial share).
    """
    values: dict[str, Any] = {}
    if table := inputs.get("table_1"):
        values |= _compare_targets(table, context)
    if lengths := inputs.get("segments", {}).get("lengths"):
        fit = fit_sigmoid([np.array(one, dtype=float) for one in lengths])
        values["inputs.sigmoid_residual"] = fit.squared_residual
    if speeds := inputs.get("exploration", {}).get("angular_speed"):
        values["inputs.explore"] = float(np.mean(speeds))
    if contacts := inputs.get("robot", {}).get("contacts"):
        values |= _classify(contacts, folder, context)
    return values


def _compare_targets(table: Mapping[str, float], context: Context) -> dict[str, float]:
    known = load_targets("cockroach")
    asked = known.replace(
        status="measured",
        targets=tuple(
            one.replace(value=float(table[one.name]) * _KHZ.get(one.name, 1.0), tag="P")
            for one in known.targets
            if one.name in table
        ),
    )
    problem = Problem(
        hinges=make_hinges("exponential", context.antenna),
        targets=asked,
        protocol=Protocol(engine=context.engine),
    )
    measured, error, accuracy = problem.score(PAPER_P)
    shares = measured.values / asked.values
    values = {f"inputs.{n}": float(v) for n, v in zip(measured.names, shares, strict=True)}
    if len(values) == len(known.targets):
        values |= {"inputs.cost": float(error), "inputs.msa": float(accuracy)}
    return values


def _classify(contacts: Sequence[Mapping[str, Any]], folder: Path, context: Context) -> dict:
    for number, one in enumerate(contacts, 1):
        if {*one} != _CONTACT:
            raise InvalidInput(
                f"contact {number} of [robot] needs {', '.join(sorted(_CONTACT))}, got"
                f" {', '.join(sorted(one))}."
            )
    training = make_training(engine=context.engine)
    classifier = TransferClassifier(random_state=context.seed)
    classifier.fit(training.values, training.labels)
    recordings = [load_recording(folder / one["file"]) for one in contacts]
    tensors = align_recordings(recordings, training.antenna, before=training.before)
    true = [tuple(one[part] for part in LABEL_PARTS) for one in contacts]
    score = score_transfer(classifier, tensors, true)
    pairs = zip(score.true, score.predicted, strict=True)
    right = {"transfer": 0, "speed_location": 0}
    for truth, found in pairs:
        right["transfer"] += truth == found
        right["speed_location"] += truth[1:] == found[1:]
    return {f"inputs.{name}": _share(k, len(true)) for name, k in right.items()}


def _share(k: int, n: int) -> dict[str, float]:
    ends = binomtest(k, n).proportion_ci(method="wilson")
    return make_spread(k / n, ends.low, ends.high, n=n)


def make_section(path: Path, context: Context) -> Section:
    """The report's section of these inputs, whose values statements are then judged by."""
    section = Section(
        name="inputs", title="With inputs that are not published", folder=context.out
    )
    section.values.update(compute(read_inputs(path), context, path.parent))
    section.text(f"Read from {path.name}. Statements that rest on these values are judged.")
    section.table(
        ["what", "value"],
        [
            [key.partition(".")[2], one["value"] if isinstance(one, dict) else one]
            for key, one in section.values.items()
        ],
        "Of Table 1's targets: what the model with the published constants has, as a share.",
    )
    return section
