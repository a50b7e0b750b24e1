"""A PortAudio of two devices that tests play themselves."""

from __future__ import annotations

import sys
import types
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from mosaic_audio import devices


class PortAudioError(Exception):
    pass


@dataclass
class FakeStream:
    options: dict[str, Any]
    written: list[Any] = field(default_factory=list)
    is_running: bool = False
    is_closed: bool = False
    is_unplugged: bool = False
    pieces: int = 3
    """How many it hears at once when it starts, each one louder than the one before."""
    heard_at_s: float = 4.97
    """By its own clock, where it is 5.0 now."""

    def start(self) -> None:
        self.is_running = True
        if "callback" in self.options:
            times = types.SimpleNamespace(currentTime=5.0, inputBufferAdcTime=self.heard_at_s)
            for level in range(1000, 1000 + self.pieces):
                samples = np.full((self.options["blocksize"], self.options["channels"]), level, np.int16)
                self.options["callback"](samples, len(samples), times, None)

    def write(self, samples: Any) -> None:
        if self.is_unplugged:
            raise PortAudioError("Unanticipated host error")
        self.written.append(samples.copy())

    def abort(self, ignore_errors: bool) -> None:
        self.is_running = False

    def close(self, ignore_errors: bool) -> None:
        self.is_closed = True


class FakePortAudio(types.ModuleType):
    def __init__(self) -> None:
        super().__init__("sounddevice")
        self.PortAudioError = PortAudioError
        self.plugged_in = [
            {"name": "headset", "max_input_channels": 1, "max_output_channels": 1},
            {"name": "monitor", "max_input_channels": 0, "max_output_channels": 2},
        ]
        self.streams: list[FakeStream] = []
        self.is_busy = False
        self.begins = 0
        self.stream_facts: dict[str, Any] = {}
        """How the next streams are."""
        self._initialize()

    def _initialize(self) -> None:
        """PortAudio looks for devices now, and never again."""
        self.devices = list(self.plugged_in)
        self.begins += 1

    def _terminate(self) -> None:
        assert all(stream.is_closed for stream in self.streams), "it ends every stream"
        self.devices = []

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
        self.streams.append(FakeStream(options, **self.stream_facts))
        return self.streams[-1]

    InputStream = OutputStream = _stream


@pytest.fixture
def portaudio(monkeypatch: pytest.MonkeyPatch) -> FakePortAudio:
    fake = FakePortAudio()
    monkeypatch.setitem(sys.modules, "sounddevice", fake)
    monkeypatch.setattr(devices, "DEVICES", devices.DeviceList())
    return fake
