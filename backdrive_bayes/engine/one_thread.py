"""One BLAS thread while a result is computed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep the linear algebra in one thread, as a context or as a decorator.

    Sums in another order would change the last bits of a result; and the arrays are small, so that threads would spend their
    time waiting for each other.
    """
    with threadpool_limits(1, user_api="blas"):
        yield
