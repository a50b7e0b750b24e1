"""Repeats of several cameras find their receivers, and sources without end find none. Also the contract with aiortc."""

from __future__ import annotations

import asyncio
from typing import Any
from unittest.mock import Mock

from aiortc import RTCBundlePolicy, RTCConfiguration, RTCPeerConnection
from aiortc.rtcdtlstransport import RtpRouter
from aiortc.rtp import RtpPacket

from mosaic_core.adapters.aiortc_private.rtp.receivers import MAX_SOURCES, route_repeats
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer

RTX = 98


def test_aiortc_knows_no_receiver_of_a_repeat_where_two_have_its_payload_type() -> None:
    router, first, second = RtpRouter(), object(), object()
    for ssrc, receiver in ((1, first), (2, second)):
        router.register_receiver(receiver, ssrcs=[ssrc], payload_types=[97, RTX])  # type: ignore[arg-type]
    repeat = RtpPacket(payload_type=RTX, ssrc=11)
    assert router.route_rtp(repeat) is None
    router.ssrc_table[11] = second  # type: ignore[assignment]
    assert router.route_rtp(repeat) is second


async def test_each_camera_gets_its_own_repeats() -> None:
    configuration = RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE)
    ours, theirs = RTCPeerConnection(configuration), RTCPeerConnection(configuration)
    try:
        for _ in range(2):
            ours.addTransceiver("video", direction="recvonly")
        ours.addTransceiver("audio", direction="recvonly")
        await ours.setLocalDescription()
        await theirs.setRemoteDescription(ours.localDescription)
        for transceiver in theirs.getTransceivers():
            transceiver.direction = "sendonly"
        await theirs.setLocalDescription()
        await ours.setRemoteDescription(theirs.localDescription)
        route_repeats(ours)
        router: Any = ours.getTransceivers()[0].receiver.transport._rtp_router
        cameras = zip(ours.getTransceivers()[:2], theirs.getTransceivers(), strict=False)
        for mine, sending in cameras:
            assert router.ssrc_table[sending.sender._rtx_ssrc] is mine.receiver
    finally:
        await asyncio.gather(ours.close(), theirs.close())


async def test_packets_of_ever_more_sources_are_left_out_and_those_that_are_known_go_on() -> None:
    listener: Any = Mock()
    peer, receiver = AiortcOfferer(listener, ()), object()
    try:
        peer.add_microphone("ears")
        await peer.offer()
        router: Any = peer._peer.pc.getTransceivers()[0].receiver.transport._rtp_router
        router.register_receiver(receiver, ssrcs=[], payload_types=[96])
        for ssrc in range(3 * MAX_SOURCES):
            router.route_rtp(RtpPacket(payload_type=96, ssrc=ssrc))
        assert len(router.ssrc_table) == MAX_SOURCES
        assert [router.route_rtp(RtpPacket(payload_type=96, ssrc=one)) for one in (0, MAX_SOURCES)] == [receiver, None]
    finally:
        await peer.close()
