"""A real peer connection within this process, from a robot's half to an operator's: its path, and how fast it is.

Over loopback the figures tell of this machine's processor; with ``relay_only`` they tell of the TURN server and the
way there and back.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

_PIECE_BYTES = 16 * 1024
_IN_FLIGHT_BYTES = 512 * 1024
_MEASURE_S = 1.5
_PINGS = 5


@dataclass(frozen=True, slots=True)
class TrialResult:
    """A whole connection that was made on trial, as it was measured. ``setup_ms``: from nothing to an open data
    channel, without a server in between.
    """

    setup_ms: float
    path: ChosenPath | None
    round_trip_ms: float
    throughput_bps: float


class _Side:
    """Listens at one end; passes candidates to the other."""

    def __init__(self) -> None:
        self.channel: asyncio.Future[Channel] = asyncio.get_running_loop().create_future()
        self.state = ""
        self.failed = asyncio.Event()
        self.found: asyncio.Queue[IceCandidate] = asyncio.Queue()
        self.congestion = PeerCongestion()

    def candidate_found(self, candidate: IceCandidate) -> None:
        self.found.put_nowait(candidate)

    is_local = True

    def state_changed(self, state: str) -> None:
        self.state = state
        if state in ("failed", "closed"):
            self.failed.set()

    def bound_exceeded(self, why: str) -> None:
        self.failed.set()

    def channel_opened(self, channel: Channel) -> None:
        if not self.channel.done():
            self.channel.set_result(channel)

    def __getattr__(self, name: str) -> Any:
        return lambda *_args, **_options: None


async def peer_trial(
    ice_servers: Sequence[IceServer] = (), *, relay_only: bool = False, timeout_s: float = 8.0
) -> TrialResult:
    """Connect, measure for two seconds, close. Raises :class:`ConnectionFailed`; its code names the phase."""
    operator, robot = _Side(), _Side()
    offerer = AiortcOfferer(operator, ice_servers, relay_only=relay_only)
    answerer = AiortcAnswerer(robot, ice_servers, relay_only=relay_only)
    passing: list[asyncio.Task[None]] = []
    try:
        async with asyncio.timeout(timeout_s):
            began_s = time.monotonic()
            mine = offerer.create_channel("trial", ordered=False)
            opened = asyncio.Event()
            mine.on_open = opened.set
            sdp, _ = await offerer.offer()
            await offerer.accept_answer(await answerer.answer(sdp, (), None))
            passing = [_passing(operator, answerer), _passing(robot, offerer)]
            await _either(opened, operator.failed)
            theirs = await robot.channel
            setup_ms = (time.monotonic() - began_s) * 1000
            round_trip_ms = await _round_trip_ms(mine, theirs)
            return TrialResult(setup_ms, offerer.path(), round_trip_ms, await _throughput_bps(theirs, mine))
    except TimeoutError:
        raise ConnectionFailed(_phase_text(operator.state), code=_phase_code(operator.state)) from None
    finally:
        for task in passing:
            task.cancel()
        await asyncio.gather(offerer.close(), answerer.close())


def _passing(side: _Side, other: AiortcOfferer | AiortcAnswerer) -> asyncio.Task[None]:
    async def forward() -> None:
        while True:
            await other.add_candidate(await side.found.get())

    return asyncio.create_task(forward())


async def _either(opened: asyncio.Event, failed: asyncio.Event) -> None:
    tasks = [asyncio.create_task(opened.wait()), asyncio.create_task(failed.wait())]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
    if not opened.is_set():
        raise ConnectionFailed("The two halves found no path to each other.", code="ice.failed")


def _phase_code(state: str) -> str:
    return {"securing": "dtls.timeout", "connected": "channel.timeout"}.get(state, "ice.timeout")


def _phase_text(state: str) -> str:
    return {
        "securing": "A path was found, but DTLS did not come to its end.",
        "connected": "The connection is up, but its data channel did not open, or passed too little.",
    }.get(state, "The two halves found no path to each other in time.")


async def _round_trip_ms(one: Channel, other: Channel) -> float:
    """The shortest of some, by way of the data channel."""
    answered = asyncio.Event()
    other.on_message = lambda data: other.send(data)
    one.on_message = lambda _data: answered.set()
    best_ms = float("inf")
    for _ in range(_PINGS):
        answered.clear()
        began_s = time.monotonic()
        one.send(b"ping")
        await answered.wait()
        best_ms = min(best_ms, (time.monotonic() - began_s) * 1000)
    return best_ms


async def _throughput_bps(sender: Channel, receiver: Channel) -> float:
    """What arrives, robot to operator, while the queue is kept full."""
    arrived_bytes, drained = 0, asyncio.Event()

    def count(data: bytes | str) -> None:
        nonlocal arrived_bytes
        arrived_bytes += len(data)

    receiver.on_message, sender.on_message, sender.on_drained = count, None, drained.set
    piece, began_s = bytes(_PIECE_BYTES), time.monotonic()
    while time.monotonic() < began_s + _MEASURE_S:
        drained.clear()
        while sender.buffered_bytes < _IN_FLIGHT_BYTES:
            sender.send(piece)
        try:
            async with asyncio.timeout(max(0.01, began_s + _MEASURE_S - time.monotonic())):
                await drained.wait()
        except TimeoutError:
            break
    return arrived_bytes * 8 / (time.monotonic() - began_s)
