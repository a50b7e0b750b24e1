"""Repeats of several cameras find their receivers. Also the contract with aiortc."""

from __future__ import annotations

import asyncio
from typing import Any

from aiortc import RTCBundlePolicy, RTCConfiguration, RTCPeerConnection
from aiortc.rtcdtlstransport import RtpRouter
from aiortc.rtp import RtpPacket

from mosaic_core.adapters.aiortc_private.rtp.receivers import route_repeats

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
