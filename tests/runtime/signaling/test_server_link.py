"""One of several servers of a robot: what it says of peers and operators never touches those of another."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from mosaic_core.machines.signaling import signaling_events as session
from mosaic_core.machines.signaling.peer_admission import PeerIdentity, StartPeer, StopPeer
from mosaic_core.runtime.signaling.server_link import KnownServer, ServerLink, best_state
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.signaling import SdpAnswer

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"


def server(name: str, network: Any) -> KnownServer:
    auth = {"type": "simple-token", "robot_id": ROBOT_ID, "params": {"token": f"token of {name}"}}
    return KnownServer(name, ServerConfig.model_validate({"ws_url": f"ws://{name}", "auth": auth}), network.connect)


def link(network: Any, scope: str = "lan:") -> tuple[ServerLink, list[session.Effect]]:
    effects: list[session.Effect] = []
    return ServerLink(server("lan", network), Catalogue.of(()), scope, effects.append), effects


@pytest.mark.parametrize("scope", ["", "lan:"])
async def test_the_robot_knows_peers_by_scoped_ids_and_the_server_by_its_own(kit: Any, scope: str) -> None:
    network = kit.network()
    it, effects = link(network, scope)
    running = asyncio.create_task(it.run())
    socket = await network.ready()
    assert socket.got("authorize")[0]["data"] == "token of lan"
    socket.push("signaling.prepare_connection", {"rtcConnectionId": "p1"})
    socket.push("signaling.send_sdp_offer", {"rtcConnectionId": "p1", "sdpOffer": "offer"})
    await kit.until(lambda: any(isinstance(one, StartPeer) for one in effects))
    start = next(one for one in effects if isinstance(one, StartPeer))
    assert start.peer_id == f"{scope}p1"
    assert start.identity.session_id == f"{scope}p1", "toward an original server the session is the connection"
    assert it.introduced(start.peer_id)
    it.signal(SdpAnswer(rtc_connection_id=start.peer_id, sdp_answer="answer"))
    it.peer_connected(start.peer_id)
    await kit.until(lambda: socket.got("signaling.send_sdp_answer"))
    assert socket.got("signaling.send_sdp_answer") == [{"rtcConnectionId": "p1", "sdpAnswer": "answer"}]
    socket.push("signaling.close_peer_connection", {"rtcConnectionId": "p1"})
    await kit.until(lambda: any(isinstance(one, StopPeer) for one in effects))
    assert next(one for one in effects if isinstance(one, StopPeer)).peer_id == start.peer_id
    it.shut_down()
    await asyncio.wait_for(running, 2)


async def test_the_identity_of_a_stranger_has_no_operator_in_any_scope(kit: Any) -> None:
    it, _ = link(kit.network())
    assert it._identity(PeerIdentity("s")) == PeerIdentity("lan:s")
    assert it._identity(PeerIdentity("s", "o", "Ann")) == PeerIdentity("lan:s", "lan:o", "Ann")


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
