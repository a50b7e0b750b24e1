"""Host candidates are answered at once; what servers tell later is trickled and paired."""

from __future__ import annotations

import asyncio
import re
from typing import Any

import aioice.ice
import pytest
from aioice import stun

from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
MAPPED = ("203.0.113.5", 1234)  # TEST-NET-3


class StunServer(asyncio.DatagramProtocol):
    """Answers every binding request with one address, after ``release`` is set."""

    def __init__(self) -> None:
        self.release = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        task = asyncio.create_task(self._answer(stun.parse_message(data), addr))
        self._tasks.add(task)

    async def _answer(self, request: stun.Message, addr: Any) -> None:
        await self.release.wait()
        response = stun.Message(request.message_method, stun.Class.RESPONSE, request.transaction_id)
        response.attributes["XOR-MAPPED-ADDRESS"] = MAPPED
        self._transport.sendto(bytes(response), addr)


async def test_a_reflexive_candidate_follows_the_answer(pair: Any) -> None:
    loop = asyncio.get_running_loop()
    address = aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=False)[0]
    transport, server = await loop.create_datagram_endpoint(StunServer, local_addr=(address, 0))
    port = transport.get_extra_info("sockname")[1]
    async with pair([IceServer(urls=(f"stun:{address}:{port}",))]) as peers:
        peers.operator.create_channel("x")
        sdp, _ = await peers.operator.offer()
        answer = await peers.robot.answer(sdp, [], None)
        assert " typ host" in answer
        assert "end-of-candidates" not in answer
        assert peers.robot_side.trickled == []
        server.release.set()
        async with asyncio.timeout(WAIT_S):
            while True:
                if peers.robot_side.trickled:
                    break
                await asyncio.sleep(0.01)
        (candidate,) = peers.robot_side.trickled[:1]
        assert f"{MAPPED[0]} {MAPPED[1]} typ srflx" in candidate.candidate
        assert candidate.candidate.startswith("candidate:")
        assert candidate.sdp_mid == "0"
        await peers.operator.accept_answer(answer)
        await asyncio.gather(peers.robot_side.reaches("connected"), peers.operator_side.reaches("connected"))
    transport.close()


async def test_each_transport_of_an_offer_without_bundle_trickles_under_its_own_line(pair: Any) -> None:
    loop = asyncio.get_running_loop()
    address = aioice.ice.get_host_addresses(use_ipv4=True, use_ipv6=False)[0]
    transport, server = await loop.create_datagram_endpoint(StunServer, local_addr=(address, 0))
    server.release.set()
    port = transport.get_extra_info("sockname")[1]
    async with pair([IceServer(urls=(f"stun:{address}:{port}",))]) as peers:
        peers.operator.add_video("front")
        peers.operator.create_channel("x")
        sdp, _ = await peers.operator.offer()
        await peers.robot.answer(re.sub("a=group:BUNDLE.*\r\n", "", sdp), ["front"], None)
        async with asyncio.timeout(WAIT_S):
            while len(found := peers.robot_side.trickled) < 2:  # noqa: ASYNC110 - the side keeps a list
                await asyncio.sleep(0.01)
        assert sorted((one.sdp_mid, one.sdp_m_line_index) for one in found) == [("0", 0), ("1", 1)]
    transport.close()


async def test_without_servers_the_answer_says_that_it_is_complete(pair: Any) -> None:
    async with pair() as peers:
        peers.operator.create_channel("x")
        sdp, _ = await peers.operator.offer()
        assert "end-of-candidates" in await peers.robot.answer(sdp, [], None)


async def test_a_machine_with_loopback_alone_says_so_at_once(pair: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async with pair() as peers:
        peers.operator.create_channel("x")
        sdp, _ = await peers.operator.offer()
        monkeypatch.setattr(aioice.ice, "get_host_addresses", lambda **_: [])
        with pytest.raises(ConnectionFailed) as failed:
            await peers.robot.answer(sdp, [], None)
        assert failed.value.code == "ice.no_address"
        assert "loopback" in failed.value.cure


async def test_a_name_server_that_is_dead_costs_nothing(pair: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async with pair([IceServer(urls=("stun:stun.invalid:3478",))]) as peers:
        peers.operator.create_channel("x")
        await peers.join()
