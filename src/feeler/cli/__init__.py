"""The command line: each verb parses, calls and reports."""

from feeler.cli.app import main

__all__ = ["main"]
