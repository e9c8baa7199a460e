"""Progress of long work: a bar for people, lines of JSON for machines, else silence."""

import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import parent_process
from threading import Lock, current_thread, main_thread
from typing import TYPE_CHECKING, Any, ClassVar, TextIO

from feeler.errors import escape, get_terminal

if TYPE_CHECKING:
    from rich.progress import Progress

_PATIENCE = 5.0  # s; shorter work needs no bar
Advance = Callable[[int, int], object]


@contextmanager
def show_progress(progress: Advance | None, title: str) -> Iterator[Advance]:
    """What is to be called with (done, total): ``progress``, or a bar that appears after 5 s where
    none was handed in.
    """
    if progress is not None:
        yield progress
        return
    with ProgressBar(title, patience=_PATIENCE) as bar:
        yield bar


def _find_notebook() -> bool:
    """Whether this is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


class ProgressBar(AbstractContextManager):
    """Called with (done, total); shows done, rate and time left.

    With ``log_json`` one line of JSON per call goes to ``stream``; on a terminal or in a notebook a
    bar is drawn once ``patience`` [s] is over; otherwise nothing. Trials that were already there at
    the first call do not count towards the rate. A bar that a thread beside the main one made
    draws nothing; one of the main thread may be called from any.
    """

    _on_screen: ClassVar["ProgressBar | None"] = None  # two would write into each other

    def __init__(
        self,
        title: str = "trials",
        *,
        log_json: bool = False,
        patience: float = 0.0,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._title, self._json, self._clock = title, log_json, clock
        self._stream = sys.stderr if stream is None else stream
        self._began, self._patience = clock(), patience
        self._failed: dict[str, int] | None = None
        self._stored: int | None = None
        self._first: int | None = None
        self._bar: Progress | None = None
        self._page: Any = None  # what a notebook shows
        self._own = parent_process() is None and current_thread() is main_thread()
        self._lock = Lock()

    def __call__(self, done: int, total: int) -> None:
        with self._lock:  # threads of one piece of work may report by themselves
            self._first = done - 1 if self._first is None else self._first
            rate, left = self.measure(done, total)
            if self._json:
                event = {"event": self._title, "done": done, "total": total}
                event |= {"per_second": rate, "seconds_left": left}
                if self._stored is not None:
                    event |= {"failed": self._failed, "bytes": self._stored}
                print(json.dumps(event), file=self._stream, flush=True)
            elif self._bar or self._page or self._may_draw():
                ProgressBar._on_screen = self
                words = f"{rate:.3g}/s{self._add(done)}"
                if _find_notebook() and not self._stream.isatty():
                    self._draw_page(done, total, f"{words}, {left:.0f} s left")
                else:
                    self._draw_bar(done, total, words)
                if done >= total:
                    self.close()

    def _may_draw(self) -> bool:
        """Whether somebody looks, has waited long enough, and sees no other bar."""
        seen = self._stream.isatty() or (self._stream is sys.stderr and _find_notebook())
        waited = self._clock() - self._began >= self._patience if self._patience else True
        return bool(seen and waited and self._own and ProgressBar._on_screen is None)

    def tell(self, *, failed: Mapping[str, int], stored: int) -> None:
        """What the next call is to show beside: failures so far by reason, and bytes on disk."""
        self._failed, self._stored = dict(failed), stored

    def _add(self, done: int) -> str:
        """Size on disk and share of failures, in words."""
        words = "" if self._stored is None else f", {self._stored / 1e6:,.0f} MB"
        return words + "".join(
            f", {100 * count / done:.2g} % {name}"
            for name, count in (self._failed or {}).items()
        )

    def measure(self, done: int, total: int) -> tuple[float, float]:
        """Items per second so far, and seconds that the rest will take at that rate."""
        elapsed = max(self._clock() - self._began, 1e-9)
        rate = (done - (self._first or 0)) / elapsed
        return round(rate, 4), round((total - done) / rate, 1) if rate > 0 else 0.0

    def _draw_page(self, done: int, total: int, words: str) -> None:
        from IPython.display import HTML, display

        bar = f'<progress value="{done}" max="{total}"></progress>'
        shown = HTML(f"<div>{self._title} {bar} {done}/{total}, {words}</div>")
        if self._page is None:
            self._page = display(shown, display_id=True)
        else:
            self._page.update(shown)

    def _draw_bar(self, done: int, total: int, words: str) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        if self._bar is None:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                TextColumn("{task.fields[rate]}"),
                console=Console(file=get_terminal(self._stream)),
            )
            self._bar.start()
            self._bar.add_task(
                escape(self._title), total=total, completed=self._first or 0, rate=""
            )
        self._bar.update(self._bar.task_ids[0], completed=done, rate=escape(words))

    def close(self) -> None:
        """Leave the terminal tidy; a second call does nothing."""
        if self._bar is not None:
            self._bar.stop()
        self._bar = self._page = None
        if ProgressBar._on_screen is self:
            ProgressBar._on_screen = None

    def __exit__(self, *_: object) -> None:
        self.close()
