"""Lets one request at a time onto a line; those that cannot wait go first."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Turns:
    """A lock with a fast lane. Any thread."""

    def __init__(self) -> None:
        self._change = threading.Condition()
        self._is_taken = False
        self._waiting = {True: 0, False: 0}

    @property
    def waiting(self) -> int:
        """How many wait for their turn."""
        with self._change:
            return sum(self._waiting.values())

    @contextmanager
    def taken(self, *, urgently: bool = False) -> Iterator[None]:
        """The line for one request. ``urgently``: before all others that wait, after the one that is on its way."""
        with self._change:
            self._waiting[urgently] += 1
            try:
                self._change.wait_for(lambda: not self._is_taken and (urgently or not self._waiting[True]))
            finally:
                self._waiting[urgently] -= 1
            self._is_taken = True
        try:
            yield
        finally:
            with self._change:
                self._is_taken = False
                self._change.notify_all()
