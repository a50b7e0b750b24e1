"""Thousands of broken, mutated and unauthorised messages over the real channels: the robot answers on, and never moves.

Somebody else holds the lease all the time, so nothing that the fuzzer says may move anything. It is an operator: a
supervisor's request by force, whole and with a reason, would be granted.
"""

from __future__ import annotations

import asyncio
import json
import random
import struct
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.machines.delivery.framing import Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.words.control import CONTROL_LABEL, STOP_LABEL

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(120)]

MESSAGES = 6000
BATCH = 100
WIRE = Path(__file__).parents[1] / "wire"
SPEAKS_FOR_ITSELF = {"bye", "stop", "stop.clear", "lease.answer"}
"""Said as they are written, these may do what they say; mutated, they are as good as any."""
NASTY: tuple[Any, ...] = (
    None, True, -1, 0, 2**31, 2**32, 2**63, 2**200, 1.5, 1e308, float("nan"), float("inf"),
    "", "\0", "\ud800", "x" * 5000, [], {}, [[]] * 50, {"": {}}, "motion", "arm", "__proto__", "../..",
)  # fmt: skip


def seeds() -> list[Any]:
    cases = [case for file in sorted(WIRE.glob("control.*.json")) for case in json.loads(file.read_text())["cases"]]
    return [case["wire"] for case in cases if case["wire"]["type"] not in SPEAKS_FOR_ITSELF]


def mutated(value: Any, chance: random.Random) -> Any:
    """The same with something wrong in it, somewhere."""
    if isinstance(value, dict) and value and chance.random() < 0.85:
        key = chance.choice(sorted(value))
        match chance.randrange(4):
            case 0:
                return {name: inner for name, inner in value.items() if name != key}
            case 1:
                return {**value, str(chance.choice(NASTY))[:50]: chance.choice(NASTY)}
            case _:
                return {**value, key: mutated(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.8:
        return [*value[1:], mutated(value[0], chance)] * chance.choice((1, 1, 40))
    return chance.choice(NASTY)


def broken_text(text: bytes, chance: random.Random) -> bytes:
    match chance.randrange(5):
        case 0:
            return text[: chance.randrange(len(text) + 1)]
        case 1:
            return text + text
        case 2:
            return b"[" * chance.randrange(5000) + text
        case 3:
            at = chance.randrange(len(text))
            return text[:at] + chance.randbytes(chance.randrange(1, 9)) + text[at + 1 :]
        case _:
            return chance.randbytes(chance.randrange(200))


class Fuzzer:
    """Everything that goes over the wire next; the same for the same seed."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.seeds = seeds()
        self.seq = 0

    def packets(self) -> Iterator[bytes | str]:
        """Of one message; what `_mosaic`, `_stop` and a connector's channel are sent alike."""
        chance = self.chance
        message = chance.choice(self.seeds) if chance.random() < 0.9 else self.command()
        if chance.random() < 0.7:
            message = mutated(message, chance)
        payload = json.dumps(message).encode(errors="replace")
        if chance.random() < 0.3:
            payload = broken_text(payload, chance)
        if chance.random() < 0.1:
            yield payload.decode(errors="replace")  # not framed at all
            return
        self.seq += 1
        frame = Frame(
            chance.choice(list(PayloadKind)), payload, seq=chance.choice((self.seq, self.seq, chance.getrandbits(32))),
            epoch=chance.choice((0, 1, 2, chance.getrandbits(32))),
            stamp_us=chance.choice((time.monotonic_ns() // 1000, 0, chance.getrandbits(64))),
            flags=chance.choice((FrameFlag.NONE, FrameFlag.NONE, FrameFlag.LATCHED)),
        )  # fmt: skip
        for packet in encode_frame(frame, chance.choice((60_000, 60_000, 400))):
            if chance.random() < 0.1:
                packet = self.broken_header(packet)
            yield packet

    def command(self) -> Any:
        speed = self.chance.choice((0.5, -0.5, *NASTY))
        return {"linear": {"x": speed}, "angular": {"z": 0.3}}

    def broken_header(self, packet: bytes) -> bytes:
        position = self.chance.randrange(min(32, len(packet)))
        return packet[:position] + struct.pack("!B", self.chance.getrandbits(8)) + packet[position + 1 :]


class Barrier:
    """Pings between the batches: the robot has read all that was before and still answers."""

    def __init__(self, channel: Any) -> None:
        self.channel = channel
        self.refusals = 0
        self._waiting: dict[int, asyncio.Event] = {}
        self._reader = FrameReader()
        self._listener = channel.on_message
        channel.on_message = self._heard

    async def passed(self, number: int) -> None:
        self._waiting[number] = asyncio.Event()
        ping = json.dumps({"type": "ping", "data": {"t0": number}}).encode()
        async with asyncio.timeout(30):
            while not self._waiting[number].is_set():  # a robot answers so many pings a second, and no more
                for packet in encode_frame(Frame(PayloadKind.JSON, ping, seq=1, stamp_us=time.monotonic_ns() // 1000)):
                    self.channel.send(packet)
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._waiting[number].wait(), 0.2)

    def _heard(self, data: bytes | str) -> None:
        self._listener(data)
        frame = self._reader.read(data, time.monotonic()) if isinstance(data, bytes) else None
        message = json.loads(frame.payload) if frame else {}
        self.refusals += message.get("type") == "refusal"
        if message.get("type") == "pong" and message["data"]["t0"] in self._waiting:
            self._waiting[message["data"]["t0"]].set()


def keeping(channels: dict[str, Any]) -> Any:
    """Real peer connections whose channels a test can write to."""

    def make(listener: Any, ice_servers: Any) -> Any:
        offerer = AiortcOfferer(listener, ice_servers)
        create = offerer.create_channel

        def create_channel(label: str, **options: Any) -> Any:
            channels[label] = create(label, **options)
            return channels[label]

        offerer.create_channel = create_channel  # type: ignore[method-assign]
        return offerer

    return make


async def stopped_and_cleared(holder: Any) -> None:
    """Any peer may stop: a mutation that is still a whole stop is one."""
    if holder.control.stop_state is not None and holder.control.stop_state.is_stopped:
        await holder.control.clear_stop()


@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_comes_over_its_channels_the_robot_stands_and_answers(site: Any, until: Any, seed: int) -> None:
    async def body() -> None:
        channels: dict[str, Any] = {}
        fuzzing = site.connected(*await site.colleague("operator"), make_offerer=keeping(channels))
        async with site.connected() as holder, fuzzing as connection:
            await holder.control.take()
            await connection.sendable("cmd_vel").wait_open()
            start_s, barrier, fuzzer = time.monotonic(), Barrier(channels[CONTROL_LABEL]), Fuzzer(seed)
            for batch in range(MESSAGES // BATCH // 2):
                for _ in range(BATCH):
                    label = fuzzer.chance.choice((CONTROL_LABEL, CONTROL_LABEL, STOP_LABEL, "cmd_vel"))
                    for packet in fuzzer.packets():
                        channels[label].send(packet)
                await barrier.passed(10**9 + batch)
            assert barrier.refusals > 10
            assert site.track.moves(start_s) == []
            await stopped_and_cleared(holder)
            async with site.driving(holder):
                pass

    site.on_operators_side(body)
