"""The sections of the report, one module each; every one has ``make(context, section)``."""
