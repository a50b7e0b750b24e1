"""Finds the body of a handler and the runner that fits it: a ``def`` body on one thread of its own for life, an
``async`` one as a task.
"""

from __future__ import annotations

import inspect

from mosaic_core.contract.handler import AudioTrackHandler, DataChannelSendable, Handler, MediaTrackHandler
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.runner import Body, Consume, Runner
from mosaic_core.runtime.handlers.task_runner import TaskRunner
from mosaic_core.runtime.handlers.thread_runner import ThreadRunner
from mosaic_core.runtime.threads.failures import Failures


def runner_of(handler: Handler, host: RuntimeHost, failures: Failures) -> Runner | None:
    """The runner of the handler's body; ``None`` if it has none."""
    parts = body_of(handler)
    if parts is None:
        return None
    kind = TaskRunner if inspect.isasyncgenfunction(parts[0]) else ThreadRunner
    return kind(handler.label, *parts, host, failures)


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
