"""Targets: measured quantities that a model should reproduce, as data with spread and source."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from feeler.antenna.fact import SOURCE_TAGS
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.files import read_bytes
from feeler.toml import parse_toml

QUANTITIES = ("frequency", "damping_ratio", "ratio_71", "ratio_86")
SHIPPED = ("cockroach",)
MAX_BYTES = 2**20  # [C] of a file of targets


@dataclass(frozen=True, kw_only=True)
class Target:
    """One quantity: its ``value`` and ``spread`` (sd between animals) in ``unit``, and where it
    comes from.
    """

    name: str
    value: float
    spread: float
    unit: str
    tag: str
    note: str = ""

    def __post_init__(self) -> None:
        if self.name not in QUANTITIES:
            raise InvalidInput(f"unknown target {self.name!r}; valid: {', '.join(QUANTITIES)}.")
        if not (np.isfinite(self.value) and self.value > 0):
            raise InvalidInput(
                f"target {self.name} must be a finite number > 0 {self.unit}, got {self.value}."
            )
        if not (np.isfinite(self.spread) and self.spread >= 0):
            raise InvalidInput(
                f"the spread of target {self.name} must be finite and ≥ 0, got {self.spread}."
            )
        if not set(self.tag.split("+")) <= SOURCE_TAGS.keys():
            raise InvalidInput(
                f"unknown tag {self.tag!r} of target {self.name}; valid: {', '.join(SOURCE_TAGS)}."
            )


@dataclass(frozen=True, kw_only=True)
class Targets:
    """A set of targets. ``status`` says how far to trust them: measured, reconstructed or
    synthetic.
    """

    name: str
    status: str
    targets: tuple[Target, ...]
    reference: str = ""

    def __post_init__(self) -> None:
        names = [target.name for target in self.targets]
        if not names or len(set(names)) != len(names):
            raise InvalidInput(
                f"a set of targets holds each quantity once and at least one, got {names}."
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities, in order."""
        return tuple(target.name for target in self.targets)

    @property
    def values(self) -> np.ndarray:
        """Values (target,)."""
        return np.array([target.value for target in self.targets])

    @property
    def spreads(self) -> np.ndarray:
        """Standard deviations between animals (target,)."""
        return np.array([target.spread for target in self.targets])

    def with_values(self, values: np.ndarray) -> "Targets":
        """The same set with other values, as a bootstrap draws them."""
        pairs = zip(self.targets, values, strict=True)
        changed = (Target(**{**vars(target), "value": float(value)}) for target, value in pairs)
        return Targets(
            name=self.name, status=self.status, targets=tuple(changed), reference=self.reference
        )

    def only(self, *names: str) -> "Targets":
        """The set reduced to the named quantities."""
        kept = tuple(target for target in self.targets if target.name in names)
        return Targets(name=self.name, status=self.status, targets=kept, reference=self.reference)


@checked
def make_targets(
    name: str = "custom", status: str = "measured", **values: float | tuple[float, float]
) -> Targets:
    """Targets from numbers: ``frequency=0.0175`` [kHz], or ``frequency=(value, spread)``."""
    units = {"frequency": "kHz"}
    pairs = {
        key: value if isinstance(value, tuple) else (value, 0.0) for key, value in values.items()
    }
    targets = (
        Target(name=key, value=value, spread=spread, unit=units.get(key, "1"), tag="C")
        for key, (value, spread) in pairs.items()
    )
    return Targets(name=name, status=status, targets=tuple(targets))


@checked
def load_targets(source: str | Path = "cockroach") -> Targets:
    """Targets that ship with feeler, by name, or your own from a TOML file.

    The file holds ``name``, ``status`` and per quantity a table ``[targets.QUANTITY]``: value,
    spread, unit, tag, note.
    """
    if source in SHIPPED:
        text = (files("feeler.calibration") / "data" / f"{source}.toml").read_text(encoding="utf-8")
    else:
        path = Path(source)
        if not path.is_file():
            raise InvalidInput(
                f"no targets named {str(source)!r}; shipped: {', '.join(SHIPPED)}; or give a TOML"
                " file."
            )
        text = read_bytes(path, MAX_BYTES).decode("utf-8", errors="replace")
    try:
        table = parse_toml(text, str(source))
        targets = tuple(Target(name=name, **entry) for name, entry in table["targets"].items())
        return Targets(
            name=table["name"],
            status=table["status"],
            targets=targets,
            reference=table.get("reference", ""),
        )
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            f"{source} is no set of targets ({error}). It needs name, status and a table"
            " [targets.QUANTITY] with value, spread, unit and tag for each quantity."
        ) from error
