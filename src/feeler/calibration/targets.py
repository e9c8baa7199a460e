"""Targets: measured quantities that a model should reproduce, as data with spread and source."""

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np

from feeler.antenna.fact import SourceTag
from feeler.disk.toml import make_record, read_toml
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Len, OneOf, Record

_QUANTITIES = ("frequency", "damping_ratio", "ratio_71", "ratio_86")
_SHIPPED = ("cockroach",)


class Target(Record):
    """One quantity: its value, its spread between animals, and where they come from.

    Attributes
    ----------
    value : float
        In ``unit``.
    spread : float
        Standard deviation between animals, in ``unit``.
    """

    name: Annotated[str, OneOf(_QUANTITIES)]
    value: Annotated[float, Gt(0)]
    spread: Annotated[float, Ge(0)]
    unit: str
    tag: SourceTag
    note: str = ""


class Targets(Record):
    """A set of targets.

    Attributes
    ----------
    status : str
        How far to trust them: measured, reconstructed or synthetic.
    """

    name: str
    status: str
    targets: Annotated[tuple[Target, ...], Len(1)]
    reference: str = ""

    def _check(self) -> None:
        if len(set(self.names)) != len(self.names):
            raise InvalidInput(f"a set of targets holds each quantity once, got {self.names}.")

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
        return self.replace(targets=[one.replace(value=float(value)) for one, value in pairs])

    def only(self, *names: str) -> "Targets":
        """The set reduced to the named quantities."""
        return self.replace(targets=[one for one in self.targets if one.name in names])


@checked
def make_targets(
    name: str = "custom", status: str = "measured", **values: float | tuple[float, float]
) -> Targets:
    """Targets from numbers: ``frequency=0.0175`` [kHz], or ``frequency=(value, spread)``."""
    targets = []
    for key, given in values.items():
        value, spread = given if isinstance(given, tuple) else (given, 0.0)
        unit = "kHz" if key == "frequency" else "1"
        targets.append(Target(name=key, value=value, spread=spread, unit=unit, tag="C"))
    return Targets(name=name, status=status, targets=tuple(targets))


@checked
def load_targets(source: str | Path = "cockroach") -> Targets:
    """Targets that ship with feeler, by name, or your own from a TOML file.

    The file holds ``name``, ``status`` and per quantity a table ``[targets.QUANTITY]``: value,
    spread, unit, tag, note.
    """
    path = Path(source)
    if source in _SHIPPED:
        path = Path(str(files("feeler.calibration") / "data" / f"{source}.toml"))
    if not path.is_file():
        shipped = ", ".join(_SHIPPED)
        raise InvalidInput(
            f"no targets named {str(source)!r}; shipped: {shipped}; or give a TOML file."
        )
    content = read_toml(path)
    tables = content.get("targets")
    if isinstance(tables, dict):
        content["targets"] = [
            {**table, "name": name} if isinstance(table, dict) else table
            for name, table in tables.items()
        ]
    return make_record(Targets, content, path.name)
