"""The command line: each verb parses, calls and reports."""

from feeler.cli.main import main

__all__ = ["main"]
