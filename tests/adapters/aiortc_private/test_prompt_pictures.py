"""Lost packets of received pictures: who waits how long, and that no queue stays. Also the contract with aiortc."""

from __future__ import annotations

import asyncio
import inspect
import queue
from types import SimpleNamespace
from typing import Any

import pytest
from aiortc import RTCPeerConnection, RTCRtpReceiver
from aiortc.jitterbuffer import JitterBuffer
from aiortc.rtp import RtpPacket
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.adapters.aiortc_private.rtp import receivers
from mosaic_core.adapters.aiortc_private.rtp.receivers import (
    ASK_AGAIN_S,
    PATIENCE_S,
    Gaps,
    be_prompt,
    begins_key_picture,
)

VP8 = 97
KEY, DELTA = b"\x10", b"\x11"


class Receiver:
    """What the buffer knows of aiortc's receiver."""

    def __init__(self) -> None:
        names = vars(self)
        names["_RTCRtpReceiver__codecs"] = {VP8: SimpleNamespace(mimeType="video/VP8")}
        names["_RTCRtpReceiver__decoder_thread"] = object()
        names["_RTCRtpReceiver__decoder_queue"] = queue.Queue()
        names["_RTCRtpReceiver__timestamp_mapper"] = SimpleNamespace(map=lambda timestamp: timestamp)
        names["_RTCRtpReceiver__nack_generator"] = SimpleNamespace(missing=set())
        self.asked: list[list[int]] = []

    async def _send_rtcp_nack(self, ssrc: int, lost: list[int]) -> None:
        self.asked.append(lost)


class Stream:
    """One packet each 33 ms, each of them a picture unless told otherwise; what the decoder gets is in ``pictures``."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.receiver = Receiver()
        self.buffer = receivers._PromptBuffer(self.receiver, lambda: self.now_s)  # type: ignore[arg-type]
        self.pictures: list[int] = []
        self.key_wishes = 0

    def come(self, number: int, data: bytes = DELTA, *, marker: bool = True, picture: int | None = None) -> None:
        packet = RtpPacket(payload_type=VP8, marker=int(marker), sequence_number=number)
        packet.timestamp = number if picture is None else picture
        packet._data = data  # type: ignore[attr-defined]
        missing = vars(self.receiver)["_RTCRtpReceiver__nack_generator"].missing
        missing.discard(number)
        wants_key, frame = self.buffer.add(packet)
        self.key_wishes += wants_key
        early = vars(self.receiver)["_RTCRtpReceiver__decoder_queue"]
        while not early.empty():
            self.pictures.append(early.get()[1].timestamp)
        if frame is not None:
            self.pictures.append(frame.timestamp)
        self.now_s += 0.033

    def lose(self, number: int) -> None:
        vars(self.receiver)["_RTCRtpReceiver__nack_generator"].missing.add(number)


def test_after_a_late_packet_no_queue_stays() -> None:
    stream = Stream()
    for number in (0, 1, 3, 4, 5, 6):
        stream.come(number)
    assert stream.pictures == [0, 1]
    stream.come(2)
    assert stream.pictures == [0, 1, 2, 3, 4, 5, 6]
    stream.come(7)
    assert stream.pictures[-1] == 7


def test_a_picture_is_whole_with_its_marked_packet_or_when_the_next_begins() -> None:
    stream = Stream()
    stream.come(0, marker=False, picture=0)
    assert stream.pictures == []
    stream.come(1, picture=0)
    assert stream.pictures == [0]
    stream.come(2, marker=False, picture=2)
    stream.come(3, marker=False, picture=3)
    assert stream.pictures == [0, 2]


async def test_what_is_lost_is_asked_for_again_and_at_last_given_up() -> None:
    stream = Stream()
    stream.come(0)
    stream.lose(1)
    began_s = stream.now_s
    number = 2
    while stream.now_s - began_s < PATIENCE_S + 0.1:
        stream.come(number)
        number += 1
    await asyncio.sleep(0)
    assert stream.receiver.asked == [[1]] * int(PATIENCE_S / (ASK_AGAIN_S + 0.012))
    assert stream.key_wishes == 1
    assert stream.pictures == [0, *range(3, number)]


def test_a_key_picture_needs_nothing_before_it() -> None:
    stream = Stream()
    for number in (0, 1, 3):
        stream.come(number)
    stream.come(4, KEY, marker=False)
    stream.come(5, picture=4)
    stream.come(6)
    assert stream.pictures == [0, 1, 4, 6]
    assert stream.key_wishes == 0


def test_half_a_picture_is_not_where_it_goes_on() -> None:
    stream = Stream()
    stream.come(0)
    for number in range(2, 40):
        stream.come(number, marker=False, picture=2)
    assert stream.pictures == [0]


@given(order=st.permutations(range(12)))
def test_whatever_the_order_pictures_come_once_and_ascending(order: list[int]) -> None:
    stream = Stream()
    stream.come(0)
    for number in order:
        stream.now_s -= 0.033
        stream.come(number + 1)
    assert stream.pictures == list(range(13))


@pytest.mark.parametrize(
    ("mime_type", "data", "is_key"),
    [
        ("video/VP8", KEY, True),
        ("video/VP8", DELTA, False),
        ("video/VP8", b"", False),
        ("video/H264", b"\0\0\0\1\x67", True),
        ("video/H264", b"\0\0\0\1\x65", True),
        ("video/H264", b"\0\0\0\1\x41", False),
        ("video/H264", b"\x67", False),
        ("video/AV1", KEY, False),
    ],
)
def test_key_pictures_are_known_by_their_first_bytes(mime_type: str, data: bytes, is_key: bool) -> None:
    assert begins_key_picture(mime_type, data) is is_key


@given(times=st.lists(st.floats(0.001, 0.3), min_size=1, max_size=60))
def test_who_waits_asks_at_times_and_never_longer_than_its_patience(times: list[float]) -> None:
    gaps, now_s, since_s, asked_s = Gaps(), 0.0, 0.0, 0.0
    gaps.waits(True, 0.0)
    for wait_s in times:
        now_s += wait_s
        asks, gives_up = gaps.waits(True, now_s)
        if gives_up:
            assert now_s - since_s >= PATIENCE_S
            assert gaps.waits(True, now_s) == (False, False)
            since_s = asked_s = now_s
        elif asks:
            assert now_s - asked_s >= ASK_AGAIN_S
            asked_s = now_s
        assert now_s - since_s < PATIENCE_S


async def test_aiortc_keeps_the_names_that_this_replaces() -> None:
    pc = RTCPeerConnection()
    receiver: RTCRtpReceiver = pc.addTransceiver("video", direction="recvonly").receiver
    names: Any = vars(receiver)
    assert type(names["_RTCRtpReceiver__jitter_buffer"]) is JitterBuffer
    for name in ("codecs", "decoder_thread", "decoder_queue", "timestamp_mapper", "nack_generator"):
        assert f"_RTCRtpReceiver__{name}" in names
    assert names["_RTCRtpReceiver__nack_generator"].missing == set()
    assert inspect.iscoroutinefunction(receiver._send_rtcp_nack)
    be_prompt(receiver)
    assert isinstance(names["_RTCRtpReceiver__jitter_buffer"], receivers._PromptBuffer)
    await pc.close()
