"""Noise: how much of it, relative to what, and drawn how; one object wherever noise is added.

A new model is one class with either ``sd`` or ``add``, registered under a name:

    @NOISES.register("proportional")
    class Proportional(Noise):
        def sd(self, tensors):
            return self.size * np.abs(tensors)
"""

from dataclasses import fields
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np

from feeler.errors import InvalidInput
from feeler.records import Ge, Record, Registry

_TRIED = 64  # [C] copies from which the sd of a model that only draws is estimated


class Noise(Record, kw_only=False):
    """A model of noise; a new one gives ``sd`` for Gaussian noise, or ``add`` for any other.

    Its text form is ``"name:size"``, such as ``"relative:0.1"``; see :func:`parse_noise`.

    Attributes
    ----------
    size : float
        How much, in the unit of the model; 0.1 is 10 % where it is a share.

    Raises
    ------
    InvalidInput
        A size that is not finite or below 0.
    """

    size: Annotated[float, Ge(0)] = 0.1

    is_share: ClassVar[bool] = True
    """Whether a size of 0.1 is 10 % of something, as curves over noise ratios need it."""

    @classmethod
    def from_plain(cls, value: Any) -> "Noise":
        """A noise, also from its text."""
        return parse_noise(value)

    def to_plain(self) -> Any:
        """Its text."""
        return str(self)

    def sd(self, tensors: np.ndarray) -> np.ndarray:
        """Standard deviation of each entry, broadcastable to ``tensors`` (trial, sensor, time).

        Of a model that only says how noise is added, it is estimated from 64 drawn copies.
        """
        if self.is_gaussian:
            raise InvalidInput(f"the noise {type(self).__name__} must define sd or add.")
        copies = self.add(tensors, np.random.default_rng(0), _TRIED)
        deviation = copies.reshape(_TRIED, *np.shape(tensors)) - tensors
        return np.sqrt(np.mean(deviation**2, axis=0))

    def add(
        self, tensors: np.ndarray, rng: np.random.Generator, n_copies: int = 1
    ) -> np.ndarray:
        """Copies of every trial with fresh noise (copy · trial, sensor, time), the set in turn."""
        if n_copies < 1:
            raise InvalidInput(f"n_copies must be ≥ 1, got {n_copies}.")
        drawn = rng.standard_normal((n_copies, *np.shape(tensors)), dtype=np.float32)
        copies = np.multiply(drawn, self.sd(tensors), dtype=float)
        copies += tensors
        return copies.reshape(-1, *np.shape(tensors)[1:])

    @property
    def is_gaussian(self) -> bool:
        """Whether entries get independent Gaussian noise of ``sd``."""
        return type(self).add is Noise.add

    def is_even(self, tensors: np.ndarray) -> bool:
        """Whether the noise is Gaussian with one sd over all entries of a trial.

        White noise after ``whiten`` is then exactly this noise; otherwise it stands in for it.
        """
        return self.is_gaussian and all(
            length == 1 for length in np.shape(self.sd(tensors))[1:]
        )

    def find_level(self, tensors: np.ndarray) -> np.ndarray:
        """One sd for each trial (trial or 1, 1, …): the root mean square over its entries.

        Raises
        ------
        InvalidInput
            No noise at all: a size of 0, or a trial that is zero everywhere.
        """
        sd = np.asarray(self.sd(tensors), dtype=float)
        sd = sd.reshape((1,) * (np.ndim(tensors) - sd.ndim) + sd.shape)
        rest = tuple(axis for axis in range(1, sd.ndim) if sd.shape[axis] > 1)
        level = np.sqrt(np.mean(sd**2, axis=rest, keepdims=True)) if rest else sd
        if not np.all(level > 0):
            raise InvalidInput(
                f"the noise {self} has no level for tensor {int(np.argmin(level))}: leave out"
                " tensors that are zero everywhere, and give a size > 0."
            )
        return level

    def whiten(self, tensors: np.ndarray) -> np.ndarray:
        """Tensors in whose unit the noise is white with sd ``size``; exact where ``is_even``.

        Each trial is divided by its own level. So neither loudness nor the level of the noise says
        which touch it was: over 20,000 entries a level can be told to half a per cent.
        """
        return tensors / (self.find_level(tensors) / self.size)

    def suit(self, **options: Any) -> Self:
        """The same model with those of the ``options`` (each, reference) that it asks for."""
        asked = {field.name for field in fields(self)}
        return self.replace(**{key: options[key] for key in options.keys() & asked})

    def __str__(self) -> str:
        """Text from which :func:`parse_noise` makes the same noise."""
        name = next((key for key, model in NOISES.items() if model is type(self)), None)
        rest = [
            f",{field.name}={getattr(self, field.name)}"
            for field in fields(self)
            if field.name != "size" and getattr(self, field.name) != field.default
        ]
        return f"{name or type(self).__name__}:{self.size:.12g}{''.join(rest)}"


NOISES: Registry[type[Noise]] = Registry("noise model")
"""Every known model by its name; ``NOISES.register(name, model)`` adds one."""


@NOISES.register("relative")
class Relative(Noise, kw_only=False):
    """sd = size × the greatest magnitude of each tensor, or of each vector in it (the paper's).

    Attributes
    ----------
    each : Literal[vector, tensor]
        What has a greatest magnitude of its own: each ``tensor``, or each ``vector`` h_i(t).

    Notes
    -----
    Paper, "Feature classification from tactile tensors": deviation relative to each activation
    vector's maximum.
    """

    each: Literal["vector", "tensor"] = "tensor"

    def sd(self, tensors: np.ndarray) -> np.ndarray:
        """The share of each greatest magnitude."""
        axes = tuple(range(1, np.ndim(tensors))) if self.each == "tensor" else -1
        most, least = (each(axis=axes, keepdims=True) for each in (tensors.max, tensors.min))
        return self.size * np.maximum(most, -least)


@NOISES.register("common")
class Common(Noise, kw_only=False):
    """sd = size × ``reference``: the same everywhere, as of a sensor with a fixed noise floor.

    Attributes
    ----------
    size : float
        In the unit of the tensors [rad], or of the reference.
    reference : float | None
        What a size of 1 is; None: the greatest magnitude of all tensors at hand.
    """

    size: Annotated[float, Ge(0)] = 0.03
    reference: float | None = 1.0

    def sd(self, tensors: np.ndarray) -> np.ndarray:
        """The same number for all entries."""
        unit = np.abs(tensors).max() if self.reference is None else self.reference
        return np.full((1,) * np.ndim(tensors), self.size * unit)


@NOISES.register("mixed")
class Mixed(Noise, kw_only=False):
    """sd² = size² + (share × signal)²: a fixed floor, and noise that grows with the signal (Weber).

    The two are equal where the signal is ``size / share``: below it the floor rules.

    Attributes
    ----------
    size : float
        The floor, in the unit of the tensors [rad].
    share : float
        The Weber fraction: sd over signal where the signal is large.
    each : Literal[sample, vector, tensor]
        What the signal is: the magnitude of each ``sample`` itself, or the greatest magnitude of
        its ``vector`` h_i(t) or ``tensor``.
    """

    is_share: ClassVar[bool] = False
    size: Annotated[float, Ge(0)] = 0.03
    share: Annotated[float, Ge(0)] = 0.1
    each: Literal["sample", "vector", "tensor"] = "sample"

    def sd(self, tensors: np.ndarray) -> np.ndarray:
        """The root of both squares."""
        signal = (
            np.abs(tensors) if self.each == "sample" else Relative(1.0, self.each).sd(tensors)
        )
        return np.hypot(self.size, self.share * signal)


def parse_noise(noise: float | str | Noise) -> Noise:
    """A noise from its text: the model's name, then its size, then other fields.

    A number is the size of ``Common``, the same everywhere; texts are ``"relative"``,
    ``"relative:0.1"`` and ``"relative:0.1,each=vector"``; a ``Noise`` is given back as it is.

    Raises
    ------
    InvalidInput
        No such model or field, or a size that is no number ≥ 0.
    """
    if isinstance(noise, Noise):
        return noise
    if isinstance(noise, int | float | np.number):
        return Common(float(noise))
    if not isinstance(noise, str):
        raise InvalidInput(
            "noise must be a standard deviation such as 0.1, a text such as 'relative:0.1', or a"
            f" Noise; got {str(noise)[:40]!r}."
        )
    name, _, rest = noise.partition(":")
    model = NOISES[name.strip()]
    values: dict[str, Any] = {}
    for number, part in enumerate(rest.split(",") if rest else []):
        key, equals, value = (text.strip() for text in part.partition("="))
        key, value = (key, value) if equals or number else ("size", key)
        values[key] = _read(value)
    known = [field.name for field in fields(model)]
    if unknown := sorted(values.keys() - {*known}):
        raise InvalidInput(
            f"the noise {name!r} has no {unknown[0]!r}; valid: {', '.join(known)}."
        )
    return model(**values)


def _read(value: str) -> Any:
    try:
        return float(value)
    except ValueError:
        return None if value == "None" else value
