"""A room's tests in a copy of this process: imports of other people's packages are paid once, not
once a mutant.
"""

import contextlib
import importlib
import multiprocessing
import os
import resource
import shlex
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

FORK = multiprocessing.get_context("fork")
OPTIONS = (
    "-q -x -m 'not slow' --no-header --no-summary -p no:cacheprovider -p no:xdist"
    " --hypothesis-seed=0 --hypothesis-profile=mutants"
)
OURS = (
    "feeler",
    "tests",
    "conftest",
    "_pytest",
    "pytest",
    "hypothesis",
    "_hypothesis",
    "__main__",
)


@dataclass(eq=False)
class Run:
    """What a run of tests said; also the pytest plugin that listens, and that lets quick tests go
    first.
    """

    failed: str = ""
    """The test that noticed; empty: none."""
    seconds: dict[str, float] = field(default_factory=dict)
    """How long each test took."""
    packages: list[str] = field(default_factory=list)
    """Other people's modules that were imported."""

    def pytest_collection_modifyitems(self, items: list) -> None:
        items.sort(key=lambda item: self.seconds.get(item.nodeid, 0.0))

    def pytest_runtest_logreport(self, report) -> None:
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report) -> None:
        if report.failed and not self.failed:
            self.failed = f"{report.nodeid} (import)"


def run_tests(
    folder: Path,
    tests: list[str],
    *,
    seconds: dict[str, float] | None = None,
    limit: float = 600,
) -> Run:
    """Run ``tests`` in ``folder`` until one fails; the first run (``seconds`` None) keeps what
    numba compiles.
    """
    reader, writer = FORK.Pipe(duplex=False)
    process = FORK.Process(target=_work, args=(folder, tests, seconds, int(limit), writer))
    process.start()
    writer.close()
    try:
        end = time.monotonic() + 10 * limit
        while not reader.poll(0.2) and process.is_alive() and time.monotonic() < end:
            pass  # its own workers may hold the pipe open when it is gone
        return reader.recv() if reader.poll() else Run(failed="(crashed, or out of time)")
    except EOFError:
        return Run(failed="(crashed, or out of time)")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, 9)
        process.join()


def import_packages(names: list[str]) -> None:
    """Import what the tests will import, so that every copy of this process has it."""
    for name in names:
        with contextlib.suppress(Exception):
            importlib.import_module(name)


def _work(
    folder: Path, tests: list[str], seconds: dict[str, float] | None, limit: int, writer
) -> None:
    os.setpgrp()
    os.chdir(folder)
    sys.path[:0] = [str(folder / "src"), str(folder)]  # as `python -m pytest` has it
    sys.dont_write_bytecode = seconds is not None
    os.environ |= {"PYTHONPATH": str(folder / "src")} | (
        {"PYTHONDONTWRITEBYTECODE": "1"} if seconds else {}
    )
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    with open(os.environ.get("MUTLOG", os.devnull), "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    import hypothesis
    import pytest

    finding = [
        hypothesis.Phase.explicit,
        hypothesis.Phase.generate,
    ]  # one failure is enough, however large
    hypothesis.settings.register_profile(
        "mutants", phases=finding, database=None, deadline=None
    )
    if seconds:
        from numba.core import caching

        caching.Cache.save_overload = lambda *_: None
    run = Run(seconds=dict(seconds or {}))
    code = pytest.main([*shlex.split(OPTIONS), *tests], plugins=[run])
    run.failed = run.failed or ("" if code == 0 else f"(pytest ended with {int(code)})")
    run.packages = [name for name in sys.modules if not name.startswith(OURS)]
    writer.send(run)
    os._exit(0)
