"""Functions for worker processes: they must be importable by name."""

import multiprocessing
import os
import signal
import sys
import time
from pathlib import Path


def double(x):
    return 2 * x


def has_loaded(module):
    return module in sys.modules


def name_process(_):
    return os.getpid(), multiprocessing.get_start_method()


def refuse(x):
    raise ValueError(f"no {x}")


def crash_once(item):
    """Kill the worker on the first call with this path, answer on the second."""
    x, path = item
    if path and not Path(path).exists():
        Path(path).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * x


def crash_always(x):
    if x == 3:
        os.kill(os.getpid(), signal.SIGSEGV)
    return 2 * x


def eat(n_bytes):
    return len(bytearray(n_bytes))


class Untravelled(Exception):
    def __init__(self, a, b):
        super().__init__("local words")


def raise_untravelled(_):
    raise Untravelled(1, 2)


def nap(seconds):
    time.sleep(seconds)
    return seconds


def slow(x):
    time.sleep(0.3)
    return x


def sleep_long(path):
    Path(path, str(os.getpid())).touch()
    time.sleep(600)


def step_mujoco(seconds):
    """Go in and out of the interpreter's lock, as MuJoCo's engine does, for so long."""
    import mujoco

    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        mujoco.mj_step(model, data)
