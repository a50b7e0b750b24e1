"""Checks for `mosaic doctor` the sound devices of this machine, and those that the configuration names."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from mosaic_audio.devices import Way, chosen_device, portaudio
from mosaic_audio.microphone import SUFFIXES, TONE
from mosaic_core import DeviceGone
from mosaic_core.contract.checks import CheckContext, NamedConnector
from mosaic_core.words.finding import Finding, failed, passed, skipped

_WANTED: tuple[tuple[str, str, Way], ...] = (("microphone", "source", "input"), ("speaker", "output", "output"))
"""Connector type, the param that names the device, and which way it works."""


async def examine(context: CheckContext) -> AsyncIterator[Finding]:
    """Nothing is recorded or played."""
    named = [(one, getattr(one.params, param), way) for kind, param, way in _WANTED for one in context.of_types(kind)]
    wanted = [(one, device, way) for one, device, way in named if not is_file(device)]
    try:
        sounds = await asyncio.to_thread(portaudio)
    except DeviceGone as error:
        what = error.message.removesuffix(f"; {error.cure}")
        sentence, cure = f"{what[0].upper()}{what[1:]}.", f"{error.cure[0].upper()}{error.cure[1:]}."
        if wanted:
            yield failed("audio.devices", "plugin.no_device", sentence, cure)
        else:
            yield skipped("audio.devices", sentence, cure)
        return
    yield await asyncio.to_thread(_devices, sounds)
    for one, device, way in wanted:
        yield await asyncio.to_thread(device_finding, sounds, one, device, way)


def is_file(device: int | str) -> bool:
    """A sound file or a test tone: no device at all."""
    text = str(device)
    return text.partition(":")[0] == TONE or Path(text).suffix.lower() in SUFFIXES


def _devices(sounds: Any) -> Finding:
    names = [str(one["name"]) for one in sounds.query_devices()]
    if not names:
        return skipped("audio.devices", "There is no sound device on this machine.")
    return passed("audio.devices", f"Sound devices: {', '.join(names)}.", devices=names)


def device_finding(sounds: Any, one: NamedConnector, device: int | str, way: Way) -> Finding:
    """Whether it is there and works that way."""
    check = f"audio.{one.label}"
    try:
        _, channels = chosen_device(sounds, device, way)
    except DeviceGone as error:
        what = error.message.removesuffix(f"; {error.cure}")
        return failed(check, "plugin.no_device", f"{one.label}: {what}.", f"{error.cure}.")
    return passed(check, f"{one.label}: {way} {device!r} is there.", channels=channels)
