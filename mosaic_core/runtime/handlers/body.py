"""The bodies of handlers: what runs, and what takes its items."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mosaic_core.contract.handler import AudioTrackHandler, DataChannelSendable, Handler, MediaTrackHandler

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
