"""Checks for `mosaic doctor` the video devices of this machine, and whether the configured cameras give a picture."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator, Sequence

from mosaic_camera.devices import VideoDevice, found_devices
from mosaic_camera.grabbed import WantedSource
from mosaic_camera.source import open_source, shown
from mosaic_camera.source_error import SourceError
from mosaic_core.contract.checks import CheckContext, NamedConnector
from mosaic_core.words.finding import Finding, failed, passed, skipped, warned

TYPES = ("camera", "opencv-sender-camera")


async def examine(context: CheckContext) -> AsyncIterator[Finding]:
    """Devices first, then every camera of the file: it is opened and closed again."""
    devices = found_devices()
    yield devices_finding(devices)
    for one in context.of_types(*TYPES):
        try:
            yield await asyncio.wait_for(asyncio.to_thread(camera_finding, one), context.timeout_s / 2)
        except TimeoutError:
            yield warned(f"camera.{one.label}", "media.no_first_frame", f"{one.label}: no picture in time.")


def devices_finding(devices: Sequence[VideoDevice]) -> Finding:
    """All of `/dev/video*`, and whether this account may use them."""
    if not devices:
        return skipped("camera.devices", "There is no video device on this machine.")
    names = ", ".join(f"{one.path} ({one.name})" for one in devices)
    facts = {"devices": {str(one.path): one.name for one in devices}}
    closed = [str(one.path) for one in devices if not os.access(one.path, os.R_OK | os.W_OK)]
    if closed:
        text = f"This account may not use {', '.join(closed)}."
        cure = "`sudo usermod -aG video $USER`, then log in again."
        return warned("camera.devices", "plugin.no_permission", text, cure, facts)
    return passed("camera.devices", f"Video devices: {names}.", **facts)


def camera_finding(one: NamedConnector) -> Finding:
    """One picture of one camera. Blocks; a device that a running robot holds does not open a second time."""
    check, name = f"camera.{one.label}", shown(one.params.source)
    began_s = time.monotonic()
    try:
        source = open_source(WantedSource(one.params.source, one.params.width, one.params.height, one.params.fps))
    except SourceError as error:
        code = "plugin.no_permission" if "permission" in error.message else "plugin.no_device"
        what = error.message.removesuffix(f"; {error.cure}")
        return failed(check, code, f"{one.label}: {what}.", _sentence(error.cure))
    try:
        grabbed = source.read()
    finally:
        source.close()
    if grabbed is None:
        cure = "Check cable and power; stop the robot if it runs: it holds the camera."
        return failed(check, "media.no_first_frame", f"{one.label}: {name} opens, but gives no picture.", cure)
    took_ms = round((time.monotonic() - began_s) * 1000)
    return passed(check, f"{one.label}: {name} gives a picture after {took_ms} ms.", ms=took_ms)


def _sentence(cure: str | None) -> str:
    text = (cure or "").strip()
    return f"{text[:1].upper()}{text[1:]}." if text else ""
