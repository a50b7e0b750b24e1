"""Named poses: those of the YAML file, and those that were saved to a file."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import Field, RootModel, ValidationError

from mosaic_core import Refused
from mosaic_core.words.errors import MosaicError

MAX_POSES = 100
MAX_FILE_BYTES = 1024 * 1024
PoseName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_ -]{0,63}$")]
ArmPose = dict[str, float]


class SavedPoses(RootModel[dict[PoseName, ArmPose]]):
    """What the file holds: angles in radians by joint, by name."""


class PoseBook:
    """Finds poses by name; a saved one hides the YAML file's of the same name. Any thread."""

    def __init__(self, written: Mapping[str, ArmPose], path: Path | None) -> None:
        """Raises :class:`MosaicError` (``config.invalid``) for a file that can't be read; one that does not exist is
        made when a pose is saved."""
        self._written = dict(written)
        self._path = path
        self._lock = threading.Lock()
        self._saved = {} if path is None else _read(path)

    def names(self) -> list[str]:
        with self._lock:
            return sorted({*self._written, *self._saved})

    def pose(self, name: str) -> ArmPose | None:
        with self._lock:
            return self._saved.get(name, self._written.get(name))

    def file_of(self, name: str) -> Path | None:
        """The file that a pose was saved to; ``None`` for one of the YAML file."""
        with self._lock:
            return self._path if name in self._saved else None

    def save(self, name: str, pose: ArmPose) -> None:
        """Raises :class:`Refused`."""
        if self._path is None:
            raise Refused("arm.no_pose_file")
        with self._lock:
            poses = {**self._saved, name: pose}
            if len(poses) > MAX_POSES:
                raise Refused("arm.too_many_poses", f"there are {MAX_POSES}; remove some from {self._path}")
            beside = self._path.with_name(f"{self._path.name}.new")
            try:
                beside.write_text(json.dumps(poses, indent=2) + "\n", "utf-8")
                beside.replace(self._path)
            except OSError as error:
                raise Refused("arm.no_pose_file", f"{self._path} can't be written: {error.strerror}") from error
            self._saved = poses


def _read(path: Path) -> dict[str, ArmPose]:
    try:
        text = path.read_bytes()
        if len(text) > MAX_FILE_BYTES:
            raise ValueError(f"it is larger than {MAX_FILE_BYTES} bytes")
        return SavedPoses.model_validate_json(text).root
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, ValidationError) as error:
        cure = "Mend it or remove it: an object of poses, each an object of angles in rad by joint."
        raise MosaicError(f"pose file {path}: {error}. {cure}", code="config.invalid", cure=cure) from None
