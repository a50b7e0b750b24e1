"""A PortAudio of two devices that tests play themselves."""

from __future__ import annotations

import sys
import types
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest


class PortAudioError(Exception):
    pass


@dataclass
class FakeStream:
    options: dict[str, Any]
    written: list[Any] = field(default_factory=list)
    is_running: bool = False
    is_closed: bool = False

    def start(self) -> None:
        self.is_running = True
        if "callback" in self.options:
            times = types.SimpleNamespace(currentTime=5.0, inputBufferAdcTime=4.97)
            samples = np.full((self.options["blocksize"], self.options["channels"]), 1000, np.int16)
            for _ in range(self.options.get("pieces", 3)):
                self.options["callback"](samples, len(samples), times, None)

    def write(self, samples: Any) -> None:
        self.written.append(samples.copy())

    def abort(self, ignore_errors: bool) -> None:
        self.is_running = False

    def close(self, ignore_errors: bool) -> None:
        self.is_closed = True


class FakePortAudio(types.ModuleType):
    def __init__(self) -> None:
        super().__init__("sounddevice")
        self.PortAudioError = PortAudioError
        self.devices = [
            {"name": "headset", "max_input_channels": 1, "max_output_channels": 1},
            {"name": "monitor", "max_input_channels": 0, "max_output_channels": 2},
        ]
        self.streams: list[FakeStream] = []
        self.is_busy = False

    def query_devices(self, device: int | str | None = None, kind: str | None = None) -> Any:
        if kind is None:
            return self.devices
        for number, one in enumerate(self.devices):
            if device in (None, number, one["name"]):
                return one
        raise ValueError(f"No {kind} device matching {device!r}")

    def _stream(self, **options: Any) -> FakeStream:
        if self.is_busy:
            raise PortAudioError("Device unavailable")
        self.streams.append(FakeStream(options))
        return self.streams[-1]

    InputStream = OutputStream = _stream


@pytest.fixture
def portaudio(monkeypatch: pytest.MonkeyPatch) -> FakePortAudio:
    fake = FakePortAudio()
    monkeypatch.setitem(sys.modules, "sounddevice", fake)
    return fake
