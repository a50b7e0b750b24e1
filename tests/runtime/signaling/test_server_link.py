"""One of several servers of a robot: what it says of peers and operators never touches those of another."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.contract.host import Sender
from mosaic_core.machines.signaling import signaling_events as events
from mosaic_core.machines.signaling.peer_admission import (
    AddCandidate,
    PeerIdentity,
    RenegotiatePeer,
    StartPeer,
    StopPeer,
)
from mosaic_core.runtime.signaling.server_link import Introduction, KnownServer, ServerLink, best_state
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.signaling import IceCandidate, SdpAnswer

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"


def server(name: str, network: Any) -> KnownServer:
    auth = {"type": "simple-token", "robot_id": ROBOT_ID, "params": {"token": f"token of {name}"}}
    return KnownServer(name, ServerConfig.model_validate({"ws_url": f"ws://{name}", "auth": auth}), network.connect)


class Peer:
    """What a server asks of a peer."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []

    def renegotiate(self, offer_sdp: str, tracks: Any) -> None:
        self.asked.append(("renegotiate", offer_sdp))

    def add_candidate(self, candidate: Any) -> None:
        self.asked.append(("candidate", candidate))

    def close(self, code: str, message: str = "") -> None:
        self.asked.append(("close", code))


class Peers:
    """Starts them."""

    def __init__(self) -> None:
        self.introductions: list[Introduction] = []
        self.started: list[Peer] = []

    def start_peer(self, introduction: Introduction) -> Peer:
        self.introductions.append(introduction)
        self.started.append(Peer())
        return self.started[-1]


def link(network: Any, scope: str = "lan:") -> tuple[ServerLink, Peers]:
    peers = Peers()
    return ServerLink(server("lan", network), Catalogue.of(()), scope, peers, lambda: None), peers


def start(peer_id: str, who: PeerIdentity) -> StartPeer:
    return StartPeer(peer_id, who, "offer", None, ())


@pytest.mark.parametrize("scope", ["", "lan:"])
async def test_the_robot_knows_peers_by_scoped_ids_and_the_server_by_its_own(kit: Any, scope: str) -> None:
    network = kit.network()
    it, peers = link(network, scope)
    running = asyncio.create_task(it.run())
    socket = await network.ready()
    assert socket.got("authorize")[0]["data"] == "token of lan"
    socket.push("signaling.prepare_connection", {"rtcConnectionId": "p1"})
    socket.push("signaling.send_sdp_offer", {"rtcConnectionId": "p1", "sdpOffer": "offer"})
    await kit.until(lambda: peers.introductions)
    [introduction] = peers.introductions
    assert introduction.start.peer_id == "p1"
    assert introduction.server is it
    assert introduction.sender.peer_id == f"{scope}p1"
    assert introduction.sender.session_id == f"{scope}p1", "toward an original server the session is the connection"
    it.signal(SdpAnswer(rtc_connection_id="p1", sdp_answer="answer"))
    it.peer_connected("p1")
    await kit.until(lambda: socket.got("signaling.send_sdp_answer"))
    assert socket.got("signaling.send_sdp_answer") == [{"rtcConnectionId": "p1", "sdpAnswer": "answer"}]
    socket.push("signaling.close_peer_connection", {"rtcConnectionId": "p1"})
    await kit.until(lambda: peers.started[0].asked == [("close", "peer.closed")])
    it.shut_down()
    await asyncio.wait_for(running, 30)


async def test_a_stranger_has_no_operator_id_in_any_scope(kit: Any) -> None:
    it, peers = link(kit.network())
    it._carry_out(start("p", PeerIdentity("s")))
    it._carry_out(start("q", PeerIdentity("s", "o", "Ann", "observer")))
    stranger, ann = (one.sender for one in peers.introductions)
    assert stranger == Sender("lan:p", "lan:s")
    assert ann == Sender("lan:q", "lan:s", "lan:o", "Ann", "observer")


async def test_what_a_server_says_reaches_its_own_peers_alone(kit: Any) -> None:
    network = kit.network()
    (ours, our_peers), (theirs, their_peers) = link(network, "fleet:"), link(network)
    for one in (ours, theirs):
        one._carry_out(start("same", PeerIdentity("s")))
    ours._carry_out(RenegotiatePeer("same", "again", None))
    ours._carry_out(AddCandidate("same", IceCandidate(candidate="c", sdp_mid="0")))
    ours._carry_out(StopPeer("same", "peer.closed"))
    assert [what for what, _ in our_peers.started[0].asked] == ["renegotiate", "candidate", "close"]
    assert their_peers.started[0].asked == []
    ours._carry_out(AddCandidate("same", IceCandidate(candidate="late", sdp_mid="0")))
    assert len(our_peers.started[0].asked) == 3


async def test_the_end_of_a_peer_does_not_end_the_next_one_under_its_id(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    it, peers = link(kit.network())
    ended: list[Any] = []
    monkeypatch.setattr(it._socket, "tell", ended.append)
    it._carry_out(start("p1", PeerIdentity("s")))
    it._carry_out(StopPeer("p1", "peer.replaced"))
    it._carry_out(start("p1", PeerIdentity("s")))
    first, second = peers.started
    it.peer_ended("p1", first, "peer.replaced", "")
    assert ended == []
    it.peer_ended("p1", second, "ice.failed", "")
    it.peer_ended("p1", second, "ice.failed", "")
    assert ended == [events.PeerEnded("p1", "ice.failed", "")]


@pytest.mark.parametrize(
    ("states", "best"),
    [
        (["offline", "ready"], "ready"),
        (["connecting", "offline"], "connecting"),
        (["stopped", "offline"], "offline"),
        (["stopped", "stopped"], "stopped"),
    ],
)
def test_a_robot_stands_as_it_stands_to_its_best_server(states: list[str], best: str) -> None:
    assert best_state(states) == best
