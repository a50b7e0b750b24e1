"""Tells operators who came by way of another server where the robot itself serves the page, on its own network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.words.control import ControlMessage, Near

MAX_URLS = 16


class Told(Protocol):
    """One operator."""

    knows_near: bool

    @property
    def sender(self) -> Sender: ...
    def answer(self, message: ControlMessage) -> None: ...


class NearPath:
    """Event loop only. ``is_near(peer_id)``: the operator came by the near path already."""

    def __init__(self, is_near: Callable[[str], bool]) -> None:
        self._is_near = is_near
        self._urls: tuple[str, ...] = ()
        self._operators: list[Told] = []

    def joined(self, operator: Told) -> None:
        if operator.knows_near and not self._is_near(operator.sender.peer_id) and operator not in self._operators:
            self._operators.append(operator)
            if self._urls:
                operator.answer(Near(urls=self._urls))

    def left(self, operator: Told) -> None:
        if operator in self._operators:
            self._operators.remove(operator)

    def changed(self, urls: Sequence[str]) -> None:
        """Where the robot serves now; nowhere: nothing."""
        new = tuple(urls)[:MAX_URLS]
        if new == self._urls:
            return
        self._urls = new
        for operator in self._operators:
            operator.answer(Near(urls=new))
