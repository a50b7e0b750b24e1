"""The ``cmd-vel`` connector: an operator's velocity to a drive; silence or a lost operator is a stop. The framework
keeps it within the limits of ``safety`` before it gets here.
"""

from __future__ import annotations

import threading
from typing import Any, ClassVar

from mosaic_cmdvel.drive_registry import load_drive
from mosaic_cmdvel.kept_drive import KeptDrive
from mosaic_cmdvel.params import CmdVelParams, CmdVelSafety
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.host import Sender
from mosaic_core.messages import Twist
from mosaic_core.words.data_type import Delivery


class CmdVel(DataChannelReceivable[Twist]):
    """Moves ``drive`` as told. A stop holds until a newer command is handled."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    widget: ClassVar[str | None] = "drive-pad"

    def __init__(self, label: str, drive: KeptDrive, safety: CmdVelSafety) -> None:
        super().__init__(label)
        self.timeout_s = safety.timeout_s
        self.requires_lease = safety.requires_lease
        self._drive, self.keeper = drive, drive.keeper
        self._lock = threading.Lock()
        self._commander: str | None = None

    def handle_data(self, data: Twist, sender: Sender) -> None:
        """Receiver's thread."""
        with self._lock:
            self._commander = sender.peer_id
        self._drive.apply(data)

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._drive.stop()

    def peer_left(self, sender: Sender) -> None:
        """Safety thread. An operator who only watched may leave without stopping the base, and who closed the pad
        may open it again: late commands of those who left are the framework's to refuse."""
        with self._lock:
            was_commanding = self._commander == sender.peer_id
            if was_commanding:
                self._commander = None
        if was_commanding:
            self._drive.stop()


class CmdVelConfigurer(DataChannelConfigurer[CmdVelParams]):
    """Drives a base by velocity commands; stops it on silence and when the operator leaves."""

    connector_type = "cmd-vel"
    safety_model = CmdVelSafety
    example: ClassVar[dict[str, Any] | None] = {"drive": {"type": "log"}}

    def configure(self) -> CmdVel:
        drive_params = self.params.drive
        drive = load_drive(drive_params.type)(drive_params, self.shared)
        kept = self.shared.get(f"mosaic-cmdvel:{self.label}", lambda: KeptDrive(self.label, drive))
        safety = CmdVelSafety.model_validate(self.safety.model_dump())
        return CmdVel(self.label, kept, safety)
