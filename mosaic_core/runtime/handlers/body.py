"""The bodies of handlers: what runs, what takes its items, and how long it may take to stop."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from mosaic_core.contract.handler import AudioTrackHandler, DataChannelSendable, Handler, MediaTrackHandler

logger = logging.getLogger(__name__)

STOP_PATIENCE_S = 1.5
"""How long a body may take to stop; the whole robot has two seconds."""

Body = Callable[[], Any]
Consume = Callable[[Any], object]


def body_of(handler: Handler) -> tuple[Body, Consume] | None:
    """The handler's ``messages``, ``frames`` or ``sounds`` and what takes the items; ``None`` if it only pushes."""
    if isinstance(handler, MediaTrackHandler):
        return None if type(handler).frames is MediaTrackHandler.frames else (handler.frames, handler.send_frame)
    if isinstance(handler, AudioTrackHandler):
        return None if type(handler).sounds is AudioTrackHandler.sounds else (handler.sounds, handler.send_sound)
    if isinstance(handler, DataChannelSendable):
        unwritten = type(handler).messages is DataChannelSendable.messages
        return None if unwritten else (handler.messages, handler.send)
    return None


def tell_abandoned(label: str) -> None:
    logger.warning(
        "connector %r did not stop within %.1f s and was abandoned (plugin.ignored_stop)",
        label,
        STOP_PATIENCE_S,
        extra={"label": label, "code": "plugin.ignored_stop"},
    )
