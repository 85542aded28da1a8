"""Ctrl-C and SIGTERM: one line, nothing left behind, exit code 130 or 143."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Iterator

from backdrive_bayes.commands.parts import take_away_open

SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Within it both signals end the process at once; one that the process was told to ignore stays ignored."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, _stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def unstopped() -> Iterator[None]:
    """Within it both signals wait."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stop(number, frame):
    # No exception is raised: it would pass through libraries that print it, each in its own lines.
    for other in SIGNALS:
        signal.signal(other, signal.SIG_IGN)
    take_away_open()
    if "multiprocessing" in sys.modules:
        for child in sys.modules["multiprocessing"].active_children():
            child.terminate()
    clear = "\r\x1b[K" if os.isatty(2) else ""
    os.write(2, f"{clear}backdrive-bayes: {SIGNALS[number]}\n".encode())
    os._exit(128 + number)
