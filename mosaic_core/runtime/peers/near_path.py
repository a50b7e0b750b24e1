"""Tells operators who came by way of another server where the robot itself serves the page, on its own network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from mosaic_core.words.control import ControlMessage, Near

MAX_URLS = 16


class Told(Protocol):
    """One operator."""

    wants_near: bool
    """It knows the word, and came another way."""

    def answer(self, message: ControlMessage) -> None: ...


class NearPath:
    """Keeps the addresses at which the robot serves itself, and who is to hear of them. Event loop only."""

    def __init__(self) -> None:
        self._urls: tuple[str, ...] = ()
        self._operators: list[Told] = []

    def operator_joined(self, operator: Told) -> None:
        if operator.wants_near and operator not in self._operators:
            self._operators.append(operator)
            if self._urls:
                operator.answer(Near(urls=self._urls))

    def operator_left(self, operator: Told) -> None:
        if operator in self._operators:
            self._operators.remove(operator)

    def urls_changed(self, urls: Sequence[str]) -> None:
        """Where the robot serves now; nowhere: nothing."""
        new = tuple(urls)[:MAX_URLS]
        if new == self._urls:
            return
        self._urls = new
        for operator in self._operators:
            operator.answer(Near(urls=new))
