"""Drive ``callback``: calls a Python function, for programs that move the robot themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from pydantic import Field, ImportString

from mosaic_cmdvel.drive import Drive, DriveParams
from mosaic_core.messages import STANDSTILL, Twist


class CallbackParams(DriveParams):
    type: Literal["callback"] = "callback"
    function: ImportString[Callable[[Twist], None]] = Field(
        description="Called with each Twist: module:function in YAML, or the function itself in Python."
    )


class CallbackDrive(Drive[CallbackParams]):
    """A drive that calls a function of yours: ``function(twist)`` on the receiver's thread; ``function(STANDSTILL)`` to
    stop, on any thread, also while an earlier call still runs.
    """

    def apply(self, twist: Twist) -> None:
        self.params.function(twist)

    def stop(self) -> None:
        self.params.function(STANDSTILL)
