"""What `mosaic doctor` says of sound devices; nothing is recorded or played."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_audio import doctor
from mosaic_audio.microphone import MicrophoneParams
from mosaic_core import DeviceGone
from mosaic_core.contract.checks import CheckContext, NamedConnector
from mosaic_core.words.finding import Finding


class Sounds:
    PortAudioError = RuntimeError

    def query_devices(self, device: Any = None, way: str = "") -> Any:
        mic = {"name": "USB mic", "max_input_channels": 1, "max_output_channels": 0}
        if not way:
            return [mic]
        if device in (None, "USB mic"):
            return mic
        raise ValueError(device)


def found(source: str) -> list[Finding]:
    context = CheckContext((NamedConnector("microphone", "ear", MicrophoneParams(source=source)),))

    async def collect() -> list[Finding]:
        return [finding async for finding in doctor.examine(context)]

    return asyncio.run(collect())


def test_a_device_that_is_there_is_fine_and_another_is_told_with_those_there_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(doctor, "portaudio", Sounds)
    assert [one.status for one in found("USB mic")] == ["ok", "ok"]
    _, missing = found("Other")
    assert (missing.check, missing.code) == ("audio.ear", "plugin.no_device")
    assert "USB mic" in missing.cure


def test_without_portaudio_only_who_needs_it_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> SimpleNamespace:
        raise DeviceGone("the PortAudio library is not installed", "install it")

    monkeypatch.setattr(doctor, "portaudio", none)
    assert [(one.status, one.sentence) for one in found("tone:440")] == [
        ("skipped", "The PortAudio library is not installed.")
    ]
    assert [one.code for one in found("default")] == ["plugin.no_device"]
