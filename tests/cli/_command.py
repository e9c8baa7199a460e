"""The command as a shell runs it, in this process: a process of its own spends two seconds on
imports.
"""

import contextlib
import io
import os
import sys
from types import SimpleNamespace
from unittest.mock import patch

from feeler.cli import main


def run(*arguments, cwd):
    """``feeler ARGUMENTS`` in a folder: its exit code and what it wrote."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        patch.object(sys, "argv", ["feeler", *arguments]),
        patch.dict(os.environ),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    return SimpleNamespace(returncode=code, stdout=out.getvalue(), stderr=err.getvalue())
