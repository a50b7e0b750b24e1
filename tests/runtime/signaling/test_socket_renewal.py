"""A socket that is left behind is closed by and by, whenever the network changes and whenever everything ends."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from mosaic_core.laboratory.joining import until
from mosaic_core.runtime.signaling.signaling_socket import SocketRenewal
from mosaic_core.words.errors import SignalingError


class Socket:
    def __init__(self) -> None:
        self.close_code: int | None = None

    async def __aiter__(self) -> AsyncIterator[str]:
        return
        yield ""

    async def send(self, text: str) -> None: ...

    async def close(self, code: int = 1000, reason: str = "") -> None:
        await asyncio.sleep(0)
        self.close_code = code


def renewal() -> SocketRenewal:
    return SocketRenewal(lambda socket: socket.close())


async def test_a_socket_that_opens_is_handed_over_and_what_hinders_it_is_raised() -> None:
    async def opening(socket: Socket | None) -> Socket:
        if socket is None:
            raise SignalingError("nobody there", code="signal.unreachable")
        return socket

    it, socket = renewal(), Socket()
    it.ask()
    assert it.is_due
    assert await it.opened(opening(socket)) is socket
    assert not it.is_due
    with pytest.raises(SignalingError, match="nobody there"):
        await it.opened(opening(None))
    await it.all_left()
    assert socket.close_code is None


async def test_a_new_network_ends_the_attempt_over_the_old_one() -> None:
    it, ended = renewal(), asyncio.Event()

    async def opening() -> Socket:
        it.ask()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()
        return Socket()

    async with asyncio.timeout(30):
        assert await it.opened(opening()) is None
        await ended.wait()


async def test_what_opens_all_the_same_after_the_network_changed_is_closed() -> None:
    it, socket = renewal(), Socket()

    async def opening() -> Socket:
        it.ask()
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            return socket  # it was there already
        raise AssertionError

    assert await it.opened(opening()) is None
    await until(lambda: socket.close_code == 1000)


async def test_what_opens_in_the_moment_in_which_everything_ends_is_closed() -> None:
    it, socket = renewal(), Socket()

    async def opening() -> Socket:
        asyncio.get_running_loop().call_soon(attempt.cancel)
        return socket

    attempt = asyncio.create_task(it.opened(opening()))
    with pytest.raises(asyncio.CancelledError):
        await attempt
    await it.all_left()
    assert socket.close_code == 1000


async def test_nobody_waits_for_who_is_left_behind_until_the_end() -> None:
    it, socket = renewal(), Socket()
    it.leave(socket)
    assert socket.close_code is None
    await it.all_left()
    assert socket.close_code == 1000
