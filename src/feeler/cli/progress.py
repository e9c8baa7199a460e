"""Progress of a batch: a bar for people, lines of JSON for machines, silence for anything else."""

import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

import typer

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def say_what_stays(words: str) -> Iterator[None]:
    """After Ctrl-C: what is kept and how to go on, and the shells' exit code for it."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"interrupted; {words}, and the same command goes on from there", err=True)
        raise typer.Exit(130) from None


class ProgressBar:
    """Called with (done, total); shows done, rate and time left.

    With ``log_json`` one line of JSON per call goes to ``stream``; on a terminal a bar is drawn;
    otherwise nothing. Trials that were already there at the first call do not count towards the
    rate.
    """

    def __init__(
        self,
        title: str = "trials",
        *,
        log_json: bool = False,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._title, self._json, self._clock = title, log_json, clock
        self._stream = sys.stderr if stream is None else stream
        self._began = clock()
        self._failed: dict[str, int] | None = None
        self._stored: int | None = None
        self._first: int | None = None
        self._bar: Progress | None = None

    def __call__(self, done: int, total: int) -> None:
        if self._first is None:
            self._first = done - 1
        rate, left = self.measure(done, total)
        if self._json:
            event = {
                "event": self._title,
                "done": done,
                "total": total,
                "per_second": rate,
                "seconds_left": left,
            }
            event |= (
                {"failed": self._failed, "bytes": self._stored} if self._stored is not None else {}
            )
            print(json.dumps(event), file=self._stream, flush=True)
        elif self._stream.isatty():
            self._draw(done, total, rate)

    def tell(self, *, failed: Mapping[str, int], stored: int) -> None:
        """What the next call is to show beside: failures so far by reason, and bytes on disk."""
        self._failed, self._stored = dict(failed), stored

    def _add(self, done: int) -> str:
        """Size on disk and share of failures, in words."""
        words = "" if self._stored is None else f", {self._stored / 1e6:,.0f} MB"
        return words + "".join(
            f", {100 * count / done:.2g} % {name}" for name, count in (self._failed or {}).items()
        )

    def measure(self, done: int, total: int) -> tuple[float, float]:
        """Items per second so far, and seconds that the rest will take at that rate."""
        elapsed = max(self._clock() - self._began, 1e-9)
        rate = (done - (self._first or 0)) / elapsed
        return round(rate, 4), round((total - done) / rate, 1) if rate > 0 else 0.0

    def _draw(self, done: int, total: int, rate: float) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        if self._bar is None:
            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
            )
            self._bar = Progress(
                *columns, TextColumn("{task.fields[rate]}"), console=Console(file=self._stream)
            )
            self._bar.start()
            self._bar.add_task(self._title, total=total, completed=self._first or 0, rate="")
        self._bar.update(
            self._bar.task_ids[0], completed=done, rate=f"{rate:.3g}/s{self._add(done)}"
        )
        if done >= total:
            self.close()

    def close(self) -> None:
        """Leave the terminal tidy; a second call does nothing."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def __enter__(self) -> "ProgressBar":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
