"""The sound devices of this machine, by way of PortAudio, which is looked for only when a device is used."""

from __future__ import annotations

from types import TracebackType
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


def chosen_device(sounds: Any, device: int | str, way: Way) -> tuple[int | str | None, int]:
    """What to open, and its number of channels (1 or 2). Raises :class:`DeviceGone` naming those that there are."""
    wanted = None if device == DEFAULT else device
    try:
        found = sounds.query_devices(wanted, way)
    except (ValueError, sounds.PortAudioError) as error:
        raise DeviceGone(f"no {way} device {device!r}", _cure(sounds, way)) from error
    channels = int(found[f"max_{way}_channels"])
    if channels < 1:
        raise DeviceGone(f"the device {device!r} has no {way}", _cure(sounds, way))
    return wanted, min(2, channels)


def _cure(sounds: Any, way: Way) -> str:
    names = [str(device["name"]) for device in sounds.query_devices() if device[f"max_{way}_channels"] > 0]
    return f"choose one of: {', '.join(names)}" if names else "plug one in, and see that this account is in `audio`"


class OpenStream:
    """A stream of PortAudio that is open and runs while it is entered."""

    def __init__(self, sounds: Any, way: Way, **options: Any) -> None:
        kind = sounds.InputStream if way == "input" else sounds.OutputStream
        try:
            self._stream = kind(dtype="int16", latency="low", **options)
            self._stream.start()
        except (ValueError, sounds.PortAudioError) as error:
            cure = "see that no other program holds it, and that it has this rate (`python -m sounddevice`)"
            raise DeviceGone(f"the {way} device can't be opened: {error}", cure) from error

    def write(self, samples: Any) -> None:
        """Play; waits until the device takes it."""
        self._stream.write(samples)

    def close(self) -> None:
        """Silent at once."""
        self._stream.abort(ignore_errors=True)
        self._stream.close(ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
