"""What a classifier says of one recording, how sure it is, and what the recording's notes say."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.decoding.reader import NO_CONTACT
from feeler.decoding.transfer import LABEL_PARTS, TransferClassifier
from feeler.robot.touches import Label


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The best label, the runner-up, and how they compare with the notes.

    Attributes
    ----------
    probability : float
        Of ``label``; NaN without contact.
    truth : dict[str, str | float]
        Those parts of the label that the recording's notes hold.
    known : bool
        Whether the truth, as far as it is noted, is among the classes.
    """

    label: Label
    probability: float
    runner_up: Label | None
    runner_up_probability: float
    truth: dict[str, str | float]
    known: bool

    @property
    def right(self) -> dict[str, bool]:
        """Part → whether it agrees with the notes."""
        return {
            part: _agree(self.label[LABEL_PARTS.index(part)], value)
            for part, value in self.truth.items()
        }

    def __str__(self) -> str:
        words = name_touch(self.label)
        if self.runner_up is not None:
            words += (
                f" ({self.probability:.0%}); then {name_touch(self.runner_up)}"
                f" ({self.runner_up_probability:.0%})"
            )
        if not self.truth:
            return words
        wrong = [part for part, right in self.right.items() if not right]
        verdict = f"WRONG: {', '.join(wrong)}" if wrong else "right"
        return f"{words}\n  {name_notes(self.truth)}: {verdict}" + (
            "" if self.known else " (no such class was trained)"
        )

    def to_plain(self) -> dict[str, Any]:
        """As JSON; None stands where there was no contact."""
        plain = {
            "label": describe_touch(self.label),
            "probability": None if np.isnan(self.probability) else self.probability,
            "runner_up": None if self.runner_up is None else describe_touch(self.runner_up),
            "runner_up_probability": None if self.runner_up is None else self.runner_up_probability,
        }
        return {**plain, "truth": self.truth, "right": self.right, "known": self.known}


def judge_touch(
    classifier: TransferClassifier, tensor: np.ndarray, notes: Mapping[str, str | float]
) -> Answer:
    """The answer to one aligned tensor (sensor, time); ``notes`` are ``Recording.labels``."""
    probability = classifier.predict_proba(tensor[None])[0]
    ranked = classifier.predict_top(tensor[None], 2)[0]
    chance = [
        float(probability[classifier.classes_.index(label)])
        for label in ranked
        if label != NO_CONTACT
    ]
    truth = {part: notes[part] for part in LABEL_PARTS if part in notes}
    known = any(
        all(_agree(label[LABEL_PARTS.index(p)], v) for p, v in truth.items())
        for label in classifier.classes_
    )
    return Answer(
        label=ranked[0],
        probability=chance[0] if chance else float("nan"),
        runner_up=ranked[1] if chance else None,
        runner_up_probability=chance[1] if chance else float("nan"),
        truth=truth,
        known=known,
    )


def name_notes(labels: Mapping[str, str | float]) -> str:
    """What a recording's notes say of its touch, in words; empty where they say nothing."""
    known = [(part, labels[part]) for part in LABEL_PARTS if part in labels]
    noted = [
        f"{part} {value}" if isinstance(value, str) else f"{part} {value:g}"
        for part, value in known
    ]
    return f"the notes say {', '.join(noted)}" if noted else ""


def name_touch(label: Label) -> str:
    """A label in words."""
    feature, location, speed = label
    return (
        feature
        if feature == NO_CONTACT[0]
        else f"{feature} at {location:g} of the length, {speed:g} m/s"
    )


def _agree(found: str | float, noted: str | float) -> bool:
    if isinstance(found, str) or isinstance(noted, str):
        return found == noted
    return bool(np.isclose(found, noted, rtol=1e-6))


def describe_touch(label: Label) -> dict[str, str | float | None]:
    """A label as JSON."""
    feature, location, speed = (None if value != value else value for value in label)
    return {"feature": feature, "location": location, "speed": speed}
