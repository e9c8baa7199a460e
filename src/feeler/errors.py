"""Errors of feeler: each says what is wrong, what was got, what would be right and what to do."""


class FeelerError(Exception):
    """Base of every error that feeler raises on purpose; the command line turns it into one line and exit code 2."""


class InvalidInput(FeelerError, ValueError):
    """A value, file or combination that cannot be used as given."""


class SimulationDiverged(FeelerError, RuntimeError):
    """A simulation left the finite numbers; names the trial and the time."""


class StoreError(FeelerError, OSError):
    """A store that is locked, damaged, or made by another configuration."""


class MissingExtra(FeelerError, ImportError):
    """An optional dependency is not installed; the message holds the install command."""
