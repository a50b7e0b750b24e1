"""Keeps the files of a robot's own server beside its database: the robot's id and token, and where it can be reached
now."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from uuid import UUID, uuid4

from mosaic_server.data_dir import default_data_dir, is_served
from mosaic_server.security.robot_tokens import new_robot_token


@dataclass(frozen=True, slots=True)
class Reach:
    """The addresses at which the running server can be reached, for other commands on the same machine."""

    name: str
    robot_id: str
    urls: tuple[str, ...]
    only_here: bool = False


class LanHome:
    """Keeps the files of a robot's own server in one directory, for its owner alone. One robot per directory: give
    another one its own ``MOSAIC_DATA_DIR``."""

    def __init__(self, directory: Path | None = None) -> None:
        self.directory = directory or default_data_dir() / "lan"

    def make(self) -> None:
        """Raises :class:`OSError`."""
        self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)

    @property
    def is_served(self) -> bool:
        """Whether a server runs here now."""
        return is_served(self.directory)

    def robot_id(self) -> str:
        """Of a robot whose configuration names none: made once, then kept."""
        file = self.directory / "robot-id"
        try:
            return str(UUID(file.read_text().strip()))
        except (FileNotFoundError, ValueError):
            made = str(uuid4())
            _write_private(file, made)
            return made

    def robot_token(self) -> str:
        """With which the robot presents itself; made once, then kept."""
        file = self.directory / "robot-token"
        try:
            token = file.read_text().strip()
        except FileNotFoundError:
            token = ""
        if not token:
            token = new_robot_token()
            _write_private(file, token)
        return token

    def reach(self) -> Reach | None:
        """``None`` while no server runs here, or before it listens."""
        try:
            found = json.loads((self.directory / "reach.json").read_text())
            urls = tuple(map(str, found["urls"]))
            reach = Reach(str(found["name"]), str(found["robot_id"]), urls, bool(found["only_here"]))
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return reach if self.is_served else None

    def tell_reach(self, reach: Reach) -> None:
        _write_private(self.directory / "reach.json", json.dumps(asdict(reach)))


def _write_private(file: Path, text: str) -> None:
    """Complete or not at all, and for nobody else."""
    draft = file.with_name(f".{file.name}.{os.getpid()}")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
        stream.write(text + "\n")
    draft.replace(file)
