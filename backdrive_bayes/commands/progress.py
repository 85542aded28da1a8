"""Where long work stands: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import contextlib
import math
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator

from backdrive_bayes.commands.output import in_encoding_of
from backdrive_bayes.commands.stages import Clock, Stage

PLAIN_SECONDS = 10.0
"""Longest silence where no terminal listens: a log's reader must see that the work goes on."""
PLAIN_FEWEST = 2.0
"""Seconds between two plain lines at least; a log is no animation."""
TICK_SECONDS = 0.5
CELLS = 20


@contextlib.contextmanager
def progress(*stages: Stage) -> Iterator[Callable[..., None]]:
    """Yield ``note(text, share=None)``: a bar redrawn on a terminal, elsewhere plain lines at least every ten seconds.

    Percentage and time left follow from ``share``, where a note says so, or from the typical times of ``stages``; without
    either a block runs to and fro. Before the first note nothing is written, and on a terminal nothing stays.
    """
    shown = (_Bar if sys.stderr.isatty() else _Plain)(sys.stderr, Clock(stages, time.monotonic))
    try:
        yield shown.note
    finally:
        shown.close()


class _Shown:
    """Written by a thread of its own, because notes may be half a minute apart."""

    def __init__(self, stream, clock: Clock):
        self.stream, self.clock = stream, clock
        self.done = threading.Event()
        self.thread: threading.Thread | None = None

    def note(self, text: str, share: float | None = None) -> None:
        """What is being done now, and the share of the work that is done."""
        self.clock.note(text, share)
        if self.thread is None:
            self.thread = threading.Thread(target=self._run, daemon=True)
            self.thread.start()

    def close(self) -> None:
        """End it."""
        if self.thread is not None:
            self.done.set()
            self.thread.join()

    def _run(self):
        while True:
            self._show()
            if self.done.wait(TICK_SECONDS):
                return

    def _show(self):
        raise NotImplementedError


class _Plain(_Shown):
    last, text = -math.inf, ""

    def _show(self):
        now, text = time.monotonic(), self.clock.text
        if now - self.last >= PLAIN_SECONDS or (text != self.text and now - self.last >= PLAIN_FEWEST):
            self.stream.write(in_encoding_of(self.stream, f"{plain(self.clock)}\n"))
            self.stream.flush()
            self.last, self.text = now, text


class _Bar(_Shown):
    def close(self):
        super().close()
        if self.thread is not None:
            self._write("")

    def _show(self):
        self._write(bar(self.clock))

    def _write(self, text):
        width = shutil.get_terminal_size().columns
        self.stream.write("\r\x1b[K" + in_encoding_of(self.stream, text.replace("\n", " "))[: width - 1])
        self.stream.flush()


def bar(clock: Clock) -> str:
    """One state of the bar, as text without control characters."""
    share = clock.share
    if share is None:
        at = round(clock.passed_s / TICK_SECONDS) % (2 * CELLS - 2)
        cells = "".join("#" if i == min(at, 2 * CELLS - 2 - at) else "-" for i in range(CELLS))
    else:
        full = int(CELLS * share)
        cells = "#" * full + "-" * (CELLS - full)
    return f"[{cells}] {plain(clock)}"


def plain(clock: Clock) -> str:
    """Time passed, percentage, time left and what is being done."""
    parts = [span(clock.passed_s)]
    if clock.share is not None:
        left = clock.left_s
        parts += [f"{clock.share:.0%}".rjust(3), *([f"about {span(left)} left"] if left is not None else [])]
    return f"{', '.join(parts)}: {clock.text}"


def span(seconds: float) -> str:
    """Seconds as a reader says them: 45 s, 3 min 20 s, 2 h 05 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
