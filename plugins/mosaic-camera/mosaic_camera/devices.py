"""Lists the video devices of this machine, and why one can't be opened. Reads /sys and /dev only."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mosaic_camera.source_error import SourceError

SYS_FOLDER = Path("/sys/class/video4linux")
DEV_FOLDER = Path("/dev")


@dataclass(frozen=True, slots=True)
class VideoDevice:
    """A video device: where it is and what its driver calls it."""

    path: Path
    name: str


def found_devices(sys_folder: Path = SYS_FOLDER, dev_folder: Path = DEV_FOLDER) -> list[VideoDevice]:
    """All video devices in order of their numbers; none on a machine without Video4Linux."""
    if not sys_folder.is_dir():
        return []
    entries = sorted(sys_folder.glob("video*"), key=lambda entry: (len(entry.name), entry.name))
    return [VideoDevice(dev_folder / entry.name, _name_of(entry)) for entry in entries]


def _name_of(entry: Path) -> str:
    try:
        return (entry / "name").read_text().strip()
    except OSError:
        return "unnamed"


def check_device(path: Path, devices: Sequence[VideoDevice]) -> None:
    """Raise :class:`SourceError` if ``path`` is absent or this account may not open it."""
    if not path.exists():
        found = ", ".join(f"{device.path} ({device.name})" for device in devices) or "none"
        cure = "plug the camera in" if not devices else "set `source` to one of them"
        raise SourceError(f"no such camera: {path}; found: {found}", cure)
    if not os.access(path, os.R_OK | os.W_OK):
        raise SourceError(
            f"no permission to open {path}",
            "add this account to the group that owns it, usually `sudo usermod -aG video $USER`, and log in again",
        )
