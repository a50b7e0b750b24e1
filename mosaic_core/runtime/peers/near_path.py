"""Tells operators who came by way of another server where the robot itself serves the page, on its own network."""

from __future__ import annotations

from collections.abc import Sequence

from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.words.control import Near

MAX_URLS = 16


class NearPath:
    """Keeps the addresses at which the robot serves itself, and who is to hear of them. Event loop only."""

    def __init__(self) -> None:
        self._urls: tuple[str, ...] = ()
        self._operators: list[RemoteOperator] = []

    def operator_joined(self, operator: RemoteOperator) -> None:
        if operator.wants_near and operator not in self._operators:
            self._operators.append(operator)
            if self._urls:
                operator.answer(Near(urls=self._urls))

    def operator_left(self, operator: RemoteOperator) -> None:
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
