"""The sound devices of this machine, by way of PortAudio, which is looked for only when a device is used."""

from __future__ import annotations

import contextlib
import threading
from typing import Any, Literal, Self

from mosaic_core import DeviceGone

Way = Literal["input", "output"]
DEFAULT = "default"


def portaudio() -> Any:
    """The module ``sounddevice``; raises :class:`DeviceGone` where the library PortAudio is missing."""
    try:
        import sounddevice
    except OSError as error:
        raise DeviceGone(
            "the PortAudio library is not installed",
            "install it, on Debian and Ubuntu `sudo apt install libportaudio2`",
        ) from error
    except ImportError as error:
        raise DeviceGone("the package sounddevice is not installed", "`pip install sounddevice`") from error
    return sounddevice


class DeviceList:
    """Has PortAudio look for devices anew after one was lost: it looks when it begins, and never again. To begin anew
    ends every stream, so it waits until none is open. Any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._streams = 0
        self._is_stale = False

    def query(self, sounds: Any, device: int | str | None, way: Way) -> Any:
        """What PortAudio knows of a device; its errors if it does not."""
        with self._lock:
            if self._is_stale and self._streams == 0:
                with contextlib.suppress(sounds.PortAudioError):  # it did not begin the last time
                    sounds._terminate()
                sounds._initialize()
                self._is_stale = False
            return sounds.query_devices(device, way)

    def lost(self) -> None:
        """A device is not there, or not any more."""
        with self._lock:
            self._is_stale = True

    def stream_began(self) -> None:
        with self._lock:
            self._streams += 1

    def stream_ended(self) -> None:
        with self._lock:
            self._streams -= 1


DEVICES = DeviceList()
"""One for all connectors, as PortAudio is."""


def chosen_device(sounds: Any, device: int | str, way: Way) -> tuple[int | str | None, int]:
    """What to open, and its number of channels (1 or 2). Raises :class:`DeviceGone` naming those that there are."""
    wanted = None if device == DEFAULT else device
    try:
        found = DEVICES.query(sounds, wanted, way)
    except (ValueError, sounds.PortAudioError) as error:
        DEVICES.lost()
        raise DeviceGone(f"no {way} device {device!r}", _cure(sounds, way)) from error
    channels = int(found[f"max_{way}_channels"])
    if channels < 1:
        raise DeviceGone(f"the device {device!r} has no {way}", _cure(sounds, way))
    return wanted, min(2, channels)


def _cure(sounds: Any, way: Way) -> str:
    try:
        found = sounds.query_devices()
    except sounds.PortAudioError:  # it could not begin anew
        found = ()
    names = [str(device["name"]) for device in found if device[f"max_{way}_channels"] > 0]
    return f"choose one of: {', '.join(names)}" if names else "plug one in, and see that this account is in `audio`"


class OpenStream:
    """A stream of PortAudio that is open and runs while it is entered."""

    def __init__(self, sounds: Any, way: Way, **options: Any) -> None:
        self._error = sounds.PortAudioError
        self._way = way
        self._stream: Any = None
        kind = sounds.InputStream if way == "input" else sounds.OutputStream
        DEVICES.stream_began()
        try:
            self._stream = kind(dtype="int16", latency="low", **options)
            self._stream.start()
        except (ValueError, self._error) as error:
            DEVICES.lost()
            self.close()
            cure = "see that no other program holds it, and that it has this rate (`python -m sounddevice`)"
            raise DeviceGone(f"the {way} device can't be opened: {error}", cure) from error

    def write(self, samples: Any) -> None:
        """Play; waits until the device takes it. Raises :class:`DeviceGone` when it takes nothing any more."""
        try:
            self._stream.write(samples)
        except self._error as error:
            DEVICES.lost()
            raise DeviceGone(f"the {self._way} device is gone: {error}", "check its plug; it is tried again") from error

    def lost(self) -> DeviceGone:
        """What to raise where it gives nothing any more."""
        DEVICES.lost()
        return DeviceGone(f"the {self._way} device gives no sound any more", "check its plug; it is tried again")

    def close(self) -> None:
        """Silent at once. To be called once."""
        if self._stream is not None:
            self._stream.abort(ignore_errors=True)
            self._stream.close(ignore_errors=True)
        DEVICES.stream_ended()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
