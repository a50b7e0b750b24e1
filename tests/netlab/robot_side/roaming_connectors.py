"""Runs inside the robot: numbers go out reliably, and numbers that arrive are written down."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, DataChannelSendable, Params


class Counter(DataChannelSendable[dict[str, Any]]):
    def messages(self) -> Iterator[dict[str, Any]]:
        for number, _ in enumerate(self.every(0.05)):  # whose own numbers skip what it was too late for
            yield {"n": number}


class CounterConfigurer(DataChannelConfigurer[Params]):
    connector_type = "counter"

    def configure(self) -> Counter:
        return Counter(self.label)


class NotebookParams(Params):
    file: Path


class Notebook(DataChannelReceivable[dict[str, Any]]):
    def __init__(self, label: str, file: Path) -> None:
        super().__init__(label)
        self._file = file.open("ab", buffering=0)

    def handle_data(self, data: dict[str, Any]) -> None:
        self._file.write(f"{data['n']}\n".encode())


class NotebookConfigurer(DataChannelConfigurer[NotebookParams]):
    connector_type = "notebook"

    def configure(self) -> Notebook:
        return Notebook(self.label, self.params.file)
