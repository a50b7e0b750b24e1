"""Peers on aiortc alone whose certificate is RSA, in both DTLS roles, toward our robot and our operator."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest
from aiortc import RTCBundlePolicy, RTCConfiguration, RTCDataChannel, RTCPeerConnection, RTCSessionDescription
from aiortc.mediastreams import VideoStreamTrack
from aiortc.rtcdtlstransport import RTCCertificate, SRTPProtectionProfile, generate_certificate
from aiortc.sdp import candidate_from_sdp
from cryptography.hazmat.primitives.asymmetric import rsa
from OpenSSL import SSL

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.contract.media import Captured
from mosaic_core.words.signaling import IceCandidate

pytestmark = pytest.mark.webrtc
WAIT_S = 60.0
ROLES = pytest.mark.parametrize("role", ["active", "passive"])
"""The peer's: the active one is the DTLS client."""


class RsaCertificate(RTCCertificate):
    """As stacks on OpenSSL have it: an RSA certificate, and every suite that the library thinks well of."""

    def _create_ssl_context(self, srtp_profiles: list[SRTPProtectionProfile]) -> SSL.Context:
        context = super()._create_ssl_context(srtp_profiles)
        context.set_cipher_list(b"HIGH:!aNULL")
        return context


class RsaPeer:
    """One ``RTCPeerConnection``; ``got`` has what came on its channels, which answer each message with its double."""

    def __init__(self) -> None:
        self.pc = RTCPeerConnection(RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE))
        key = rsa.generate_private_key(65537, 2048)
        certificate = RsaCertificate(key, generate_certificate(key))  # type: ignore[arg-type] # it signs with either
        self.pc._RTCPeerConnection__certificates = [certificate]  # type: ignore[attr-defined]
        self.got: asyncio.Queue[Any] = asyncio.Queue()
        self.tracks: asyncio.Queue[Any] = asyncio.Queue()
        self.pc.on("track", self.tracks.put_nowait)
        self.pc.on("datachannel", self._doubles)
        self._candidates: list[IceCandidate] = []

    def _doubles(self, channel: RTCDataChannel) -> None:
        channel.on("message", lambda message: channel.send(message * 2))

    async def offer(self, role: str) -> str:
        await self.pc.setLocalDescription(await self.pc.createOffer())
        return self.pc.localDescription.sdp.replace("a=setup:actpass", f"a=setup:{role}")

    async def answer(self, offer_sdp: str, role: str, picture: VideoStreamTrack | None) -> str:
        await self._hear(offer_sdp, "offer")
        for transceiver in self.pc.getTransceivers():
            transceiver.sender.replaceTrack(picture)
            transceiver.direction = "sendonly"
        if role == "passive":
            assert self.pc.sctp is not None
            self.pc.sctp.transport._set_role("server")
        await self.pc.setLocalDescription(await self.pc.createAnswer())
        return str(self.pc.localDescription.sdp)

    async def accept(self, answer_sdp: str) -> None:
        await self._hear(answer_sdp, "answer")

    async def _hear(self, sdp: str, kind: str) -> None:
        await self.pc.setRemoteDescription(RTCSessionDescription(sdp, kind))
        for candidate in self._candidates:
            await self.add_candidate(candidate)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        if self.pc.remoteDescription is None:
            self._candidates.append(candidate)
            return
        parsed = candidate_from_sdp(candidate.candidate.removeprefix("candidate:"))
        parsed.sdpMid = candidate.sdp_mid
        await self.pc.addIceCandidate(parsed)

    def suite(self) -> tuple[str, str]:
        """What was agreed: the cipher suite, and this peer's role."""
        assert self.pc.sctp is not None
        dtls = self.pc.sctp.transport
        assert dtls._ssl is not None
        return str(dtls._ssl.get_cipher_name()), dtls._role


@asynccontextmanager
async def ended(ours: Any, mine: AiortcAnswerer | AiortcOfferer, peer: RsaPeer) -> AsyncIterator[None]:
    """Closes both, after the test's body or :data:`WAIT_S`."""
    ours.other = peer
    try:
        async with asyncio.timeout(WAIT_S):
            yield
    finally:
        await asyncio.gather(peer.pc.close(), mine.close())
        for stream in ours.streams.values():
            stream.close()


def check_agreement(peer: RsaPeer, role: str) -> None:
    suite, actual = peer.suite()
    assert actual == {"active": "client", "passive": "server"}[role]
    assert re.match("ECDHE-RSA-" if role == "passive" else "ECDHE-ECDSA-", suite)  # named after the server's


@ROLES
async def test_an_operator_with_an_rsa_certificate_gets_data_and_a_picture_of_our_robot(
    role: str, side: Callable[[], Any], record_property: Callable[[str, object], None]
) -> None:
    record_property("pair", f"our robot ↔ aiortc operator with an RSA certificate, DTLS {role}: data, VP8")

    ours, peer = side(), RsaPeer()
    robot = AiortcAnswerer(ours, ())
    async with ended(ours, robot, peer):
        peer.pc.addTransceiver("video", direction="recvonly")
        channel, opened = peer.pc.createDataChannel("echo"), asyncio.Event()
        channel.on("open", opened.set)
        channel.on("message", peer.got.put_nowait)
        await peer.accept(await robot.answer(await peer.offer(role), ["front"], None))
        await opened.wait()
        mine = await ours.channels.get()
        mine.on_message = lambda message: mine.send(message * 2)
        channel.send("up")
        assert await peer.got.get() == "upup"
        check_agreement(peer, role)
        filming = asyncio.create_task(film(ours.watch("front")))
        picture = await (await peer.tracks.get()).recv()
        assert (picture.width, picture.height) == (320, 240)
        filming.cancel()


async def film(stream: Any) -> None:
    while True:
        stream.offer(Captured(np.full((240, 320, 3), 90, np.uint8), asyncio.get_running_loop().time()))
        await asyncio.sleep(0.05)


@ROLES
async def test_our_operator_gets_data_and_a_picture_of_a_robot_with_an_rsa_certificate(
    role: str, side: Callable[[], Any], record_property: Callable[[str, object], None]
) -> None:
    record_property("pair", f"our Python operator ↔ aiortc robot with an RSA certificate, DTLS {role}: data, VP8")

    ours, peer = side(), RsaPeer()
    operator = AiortcOfferer(ours, ())
    async with ended(ours, operator, peer):
        operator.add_video("front")
        mine = operator.create_channel("echo")
        opened, answered = asyncio.Event(), asyncio.Queue[Any]()
        mine.on_open, mine.on_message = opened.set, answered.put_nowait
        sdp, _ = await operator.offer()
        await operator.accept_answer(await peer.answer(sdp, role, VideoStreamTrack()))
        await opened.wait()
        mine.send("down")
        assert await answered.get() == "downdown"
        check_agreement(peer, role)
        label, track = await ours.tracks.get()
        picture = await track.next()
        assert (label, picture.width, picture.height) == ("front", 640, 480)
