"""Runs a sender's or a camera's body without sleeping: waiting advances the fake clock, by ``self.every``,
``self.pause`` and, in an ``async`` body, ``asyncio.sleep``."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import math
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any, Protocol, TypeVar, cast

from mosaic_core.contract.declared.code_lines import hand_over
from mosaic_core.contract.declared.yielded import items_of
from mosaic_core.contract.handler import (
    AudioTrackHandler,
    DataChannelSendable,
    Handler,
    MediaTrackHandler,
    why_unsent,
)
from mosaic_core.contract.sound import Sound
from mosaic_core.harness.fake_hosts import FakeHost, fake_host
from mosaic_core.harness.fake_loop import run_on
from mosaic_core.harness.right_kind import check_has

T = TypeVar("T")
F = TypeVar("F", covariant=True)


class _HasFrames(Protocol[F]):
    """A :class:`MediaTrackHandler`, by the pictures that its author says it yields."""

    def frames(self) -> Iterable[F] | AsyncIterator[F]: ...


PATIENCE_S = 3600.0
"""Fake seconds after which a body that yields too little is given up."""


def collect(handler: DataChannelSendable[T], count: int | None = None, *, within_s: float = PATIENCE_S) -> list[T]:
    """The first ``count`` messages that ``messages()`` yields; all of them if ``count`` is ``None``.

    Each one is also sent, as the robot would: what is no JSON raises here, ``fake_host(handler).sent`` has the bytes.
    The body is then closed, so that its ``with`` blocks exit; another ``collect`` starts it anew, as a restart would.
    Raises :class:`AssertionError` if the body ends early or yields too little ``within_s`` fake seconds, or if a robot
    would have refused a message, for a NaN that must not be absent (``losses`` counts it, and what was good is in
    ``fake_host(handler).sent_values()``); and :class:`MosaicError` (``plugin.wrong_message``) for what the class does
    not declare.
    """
    check_has(handler, "messages")
    return _run(handler, handler.messages, handler.send, count, within_s, "messages")


def take_frames(handler: _HasFrames[F], count: int | None = None, *, within_s: float = PATIENCE_S) -> list[F]:
    """The first ``count`` pictures that ``frames()`` of a :class:`MediaTrackHandler` yields, of the type that it says;
    the rest is as in :func:`collect`."""
    camera = cast(MediaTrackHandler, handler)
    check_has(camera, "frames")
    return _run(camera, camera.frames, camera.send_frame, count, within_s, "frames")


def take_sounds(handler: AudioTrackHandler, count: int | None = None, *, within_s: float = PATIENCE_S) -> list[Sound]:
    """The first ``count`` pieces that ``sounds()`` yields; the rest is as in :func:`collect`."""
    check_has(handler, "sounds")
    return _run(handler, handler.sounds, handler.send_sound, count, within_s, "sounds")


def _run(
    handler: Handler,
    body: Callable[[], Iterable[Any] | AsyncIterator[Any]],
    consume: Callable[[Any], object],
    count: int | None,
    within_s: float,
    noun: str,
) -> list[Any]:
    if count is not None and (isinstance(count, bool) or not isinstance(count, int)):
        raise TypeError(f"take a whole number of the {noun}, not {count!r}")
    if not isinstance(within_s, int | float):
        raise TypeError(f"within_s is a number of seconds, not {within_s!r}")
    if count is not None and count < 1:
        raise ValueError(f"take 1 of the {noun} or more, not {count}; all of them without a count")
    host = fake_host(handler)
    host.arm()
    host.stop_at_s = host.clock.now_s + within_s
    taken: list[Any] = []
    refused: list[str] = []

    def take(item: Any) -> bool:
        before = host.losses["refused"]
        consume(item)
        if host.losses["refused"] > before:
            refused.append(why_unsent(handler, item))
            return False
        taken.append(item)
        return len(taken) == count

    try:
        if inspect.isasyncgenfunction(body):
            run_on(host.clock, lambda: _iterate_async(body(), take, host))
        else:
            _iterate(items_of(body), take, host)
    finally:
        host.stop()
        host.stop_at_s = float("inf")
    if refused:
        what = f"{len(refused)} of {len(taken) + len(refused)} {noun} would be refused on a robot"
        raise AssertionError(f"{handler.label}: {what}: {refused[0]}")
    if count is not None and len(taken) < count:
        raise AssertionError(f"{handler.label}: {len(taken)} of {count} {noun} within {within_s:g} s of fake time")
    return taken


def _iterate(stream: Iterable[Any], take: Callable[[Any], bool], host: FakeHost) -> None:
    try:
        for item in stream:
            if host.is_stopping or hand_over(stream, item, take):
                break
    finally:
        host.stop()
        close = getattr(stream, "close", None)
        if close is not None:
            close()


async def _iterate_async(stream: Any, take: Callable[[Any], bool], host: FakeHost) -> None:
    left_s = host.stop_at_s - host.clock.now_s
    try:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(left_s if math.isfinite(left_s) else None):
                async for item in stream:
                    if host.is_stopping or hand_over(stream, item, take):
                        break
    finally:
        host.stop()
        await stream.aclose()
