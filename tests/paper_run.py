"""A run of the whole paper at smoke scale, in processes of its own."""

import subprocess
import sys


def start(out, *options, run=("-m", "paper")):
    """``python -m paper`` at smoke scale in a process group of its own."""
    command = [
        sys.executable,
        *run,
        "--scale",
        "smoke",
        "--out",
        str(out),
        *options,
    ]
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
    )
