"""The pluggy hooks of a robot, group ``mosaic.plugins``. Write any of them with :data:`hookimpl`.

All are called on the robot's event loop; return quickly. An exception in a hook is logged and stops nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pluggy

from mosaic_core.contract.host import Sender

if TYPE_CHECKING:
    from mosaic_core.contract.configurer import Configurer
    from mosaic_core.contract.handler import Handler
    from mosaic_core.words.config import RobotConfig

PROJECT = "mosaic"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)
"""Marks a function as a hook of a robot."""


@hookspec
def mosaic_before_configure(config: RobotConfig, configurers: Sequence[Configurer]) -> None:  # type: ignore[type-arg]
    """Every connector is resolved and its params are valid; none is configured yet."""


@hookspec
def mosaic_after_configure(config: RobotConfig, handlers: Sequence[Handler]) -> None:
    """All handlers exist; the robot is not connected yet."""


@hookspec
def mosaic_robot_state_changed(state: str) -> None:
    """``connecting``, ``ready``, ``offline`` or ``stopped``: the robot's relation to its server."""


@hookspec
def mosaic_peer_connected(sender: Sender) -> None:
    """An operator's peer connection is up."""


@hookspec
def mosaic_peer_closed(sender: Sender, code: str) -> None:
    """An operator's peer connection ended; ``code`` says why."""


@hookspec
def mosaic_connector_failed(label: str, error: BaseException, restart_in_s: float) -> None:
    """A handler ended with an error and will be restarted."""


@hookspec
def mosaic_command_received(label: str, sender: Sender, accepted: bool, code: str, gate: str) -> None:
    """A message for a receiver arrived; ``code`` says why it was refused, ``gate`` what on the way of a command refused
    it; both are empty if nothing did."""


@hookspec
def mosaic_lease_changed(resource: str, holder: Sender | None, epoch: int, cause: str) -> None:
    """``holder`` commands ``resource`` from now on, ``None``: nobody does. ``cause`` says why the one before lost
    it, or is empty if it was free."""


@hookspec
def mosaic_stop_changed(is_stopped: bool, by: str, reason: str) -> None:
    """An operator said stop, or it was cleared; ``by`` is the name of whoever did."""


@hookspec
def mosaic_loop_blocked(label: str, place: str, duration_s: float) -> None:
    """The event loop was blocked, and goes on again. ``label`` names the connector whose code did it, or is empty;
    ``place`` the line: ``camera.py:42 in Camera.frames``."""
