"""Through a real coturn, run with the configuration that the documentation recommends.

    robot ── NAT ── public network (server, coturn) ── NAT ── operator

Both NATs take another port for every destination, so no direct path exists.
"""

from __future__ import annotations

import asyncio
import re
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import aioice.stun
import aioice.turn
import pytest
from laboratory.fleet import Fleet
from laboratory.nats import OPERATOR_WAN, ROBOT_WAN, NatLab
from laboratory.turn_server import DEAD, SECRET, TURN_IP, URLS, Coturn

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer, IceTransportPolicy
from mosaic_server.security.turn_credentials import turn_credential

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(120)]


def servers(*urls: str, lifetime_s: float = 600, later_s: float = 0.0) -> tuple[IceServer, ...]:
    credential = turn_credential(SECRET, "rover", time.time() + later_s, lifetime_s)
    return (IceServer(urls=urls, username=credential.username, credential=credential.password),)


class Ear:
    """Listens at one end of a peer connection, for messages only."""

    def __init__(self) -> None:
        self.heard: asyncio.Queue[bytes | str] = asyncio.Queue()
        self.congestion = PeerCongestion()

    def channel_opened(self, channel: Any) -> None:
        channel.on_message = self.heard.put_nowait

    def __getattr__(self, name: str) -> Any:
        return lambda *_args, **_options: None


async def offered(ice_servers: tuple[IceServer, ...]) -> tuple[str, float]:
    """A description with relayed candidates only, and how long it took."""
    offerer = AiortcOfferer(Ear(), ice_servers, relay_only=True)
    offerer.create_channel("x")
    start_s = time.monotonic()
    try:
        sdp, _ = await offerer.offer()
        return sdp, time.monotonic() - start_s
    finally:
        await offerer.close()


def trust(monkeypatch: pytest.MonkeyPatch, coturn: Coturn) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(coturn.certificate))


def mapped(server: tuple[str, int], bound: socket.socket) -> tuple[str, int]:
    """Our address as a STUN server sees it."""
    request = aioice.stun.Message(aioice.stun.Method.BINDING, aioice.stun.Class.REQUEST)
    bound.sendto(bytes(request), server)
    host, port = aioice.stun.parse_message(bound.recv(1500)).attributes["XOR-MAPPED-ADDRESS"]
    return host, port


@pytest.mark.usefixtures("coturn")
@pytest.mark.parametrize(("who", "wan"), [("robot", ROBOT_WAN), ("operator", OPERATOR_WAN)])
def test_the_nats_take_another_port_for_every_destination(nat_lab: NatLab, who: str, wan: str) -> None:
    def ask() -> list[tuple[str, int]]:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
            bound.settimeout(5)
            bound.bind(("0.0.0.0", 0))  # noqa: S104 - in a network of its own
            return [mapped((TURN_IP, port), bound) for port in (3478, 5349)]

    (one, one_port), (other, other_port) = nat_lab.networks[who].run(ask)
    assert one == other == f"{wan}.11"
    assert one_port != other_port


@pytest.mark.usefixtures("coturn")
@pytest.mark.parametrize("way", URLS)
def test_a_relay_is_reached_by_udp_tcp_and_tls(
    nat_lab: NatLab, way: str, monkeypatch: pytest.MonkeyPatch, coturn: Coturn
) -> None:
    trust(monkeypatch, coturn)
    sdp, _ = nat_lab.on_operators_side(lambda: offered(servers(URLS[way])))
    assert re.findall(r" typ (\w+)", sdp) == ["relay"]
    assert f" {TURN_IP} " in sdp


@pytest.mark.usefixtures("coturn")
def test_a_tls_certificate_that_nobody_vouches_for_is_refused(nat_lab: NatLab) -> None:
    with pytest.raises(ConnectionFailed) as failed:
        nat_lab.on_operators_side(lambda: offered(servers(URLS["tls"])))
    assert failed.value.code == "ice.no_relay"


@pytest.mark.usefixtures("coturn")
def test_a_dead_first_url_costs_nothing(nat_lab: NatLab) -> None:
    sdp, took_s = nat_lab.on_operators_side(lambda: offered(servers(DEAD, URLS["udp"])))
    assert " typ relay" in sdp
    assert took_s < 3, "waiting for the dead one takes five seconds"


@pytest.mark.usefixtures("coturn")
def test_expired_credentials_are_refused_and_fresh_ones_work(nat_lab: NatLab) -> None:
    with pytest.raises(ConnectionFailed) as failed:
        nat_lab.on_operators_side(lambda: offered(servers(URLS["udp"], later_s=-660)))
    assert failed.value.code == "ice.no_relay"
    sdp, _ = nat_lab.on_operators_side(lambda: offered(servers(URLS["udp"])))
    assert " typ relay" in sdp


def refresh_request() -> aioice.stun.Message:
    request = aioice.stun.Message(aioice.stun.Method.REFRESH, aioice.stun.Class.REQUEST)
    request.attributes["LIFETIME"] = 600
    return request


@pytest.mark.usefixtures("coturn")
def test_a_live_connection_outlives_its_credentials(nat_lab: NatLab) -> None:
    async def body() -> None:
        given = servers(URLS["udp"], lifetime_s=4)
        ends_at_s = int((given[0].username or "").partition(":")[0])
        mine, theirs = Ear(), Ear()
        offerer = AiortcOfferer(mine, given, relay_only=True)
        answerer = AiortcAnswerer(theirs, given, relay_only=True)
        try:
            channel, opened = offerer.create_channel("x"), asyncio.Event()
            channel.on_open = opened.set
            relay, _ = await aioice.turn.create_turn_endpoint(
                asyncio.DatagramProtocol, (TURN_IP, 3478), given[0].username, given[0].credential
            )
            sdp, _ = await offerer.offer()
            await offerer.accept_answer(await answerer.answer(sdp, [], None))
            async with asyncio.timeout(20):
                await opened.wait()
                while time.time() <= ends_at_s + 2:
                    channel.send("still here")
                    assert await theirs.heard.get() == "still here"
                    await asyncio.sleep(0.2)
            inner: Any = vars(relay)["_TurnTransport__inner_protocol"]
            kept = await inner.request_with_retry(refresh_request())
            assert kept[0].attributes["LIFETIME"] >= 600, "it is kept alive after them too"
            await inner.delete()
            with pytest.raises(ConnectionFailed):
                await offered(given)
        finally:
            await asyncio.gather(offerer.close(), answerer.close())

    nat_lab.on_operators_side(body)


@pytest.mark.usefixtures("coturn")
@pytest.mark.parametrize("address", ["127.0.0.1", "10.0.0.7", "172.16.5.5", "192.168.2.2", "169.254.169.254"])
def test_nobody_gets_through_the_relay_into_a_private_network(nat_lab: NatLab, address: str) -> None:
    async def body() -> None:
        credential = turn_credential(SECRET, "rover", time.time())
        transport, _ = await aioice.turn.create_turn_endpoint(
            asyncio.DatagramProtocol, (TURN_IP, 3478), credential.username, credential.password
        )
        inner: Any = vars(transport)["_TurnTransport__inner_protocol"]
        try:
            with pytest.raises(aioice.stun.TransactionFailed) as refused:
                await inner.channel_bind(0x4000, (address, 80))
            assert refused.value.response.error_code == 403
            await inner.channel_bind(0x4001, (f"{OPERATOR_WAN}.11", 80))
        finally:
            await inner.delete()

    nat_lab.on_operators_side(body)


@pytest.fixture
def forbidding(nat_lab: NatLab) -> Iterator[Callable[..., None]]:
    yield nat_lab.forbid
    nat_lab.allow_all()


async def through(fleet: Fleet, policy: IceTransportPolicy = "all") -> tuple[float, list[str]]:
    async with await fleet.signed_in(policy) as operator:
        attempt = await fleet.attempt(operator)
        return attempt.data_s, attempt.issued


@pytest.mark.parametrize("policy", ["all", "relay"])
def test_with_symmetric_nat_on_both_sides_they_meet_at_the_relay(
    nat_lab: NatLab,
    fleet: Fleet,
    coturn: Coturn,
    monkeypatch: pytest.MonkeyPatch,
    policy: IceTransportPolicy,
) -> None:
    trust(monkeypatch, coturn)
    took_s, issued = nat_lab.on_operators_side(lambda: through(fleet, policy))
    assert took_s < 5, "the first URL is dead, and waiting for one takes that long"
    assert re.fullmatch(r"\d+:[0-9a-f-]{36}", issued[0])
    allocated = re.findall(r"user <\d+:([0-9a-f-]{36})>", coturn.log.read_text())
    assert {fleet.account["robotId"], issued[0].partition(":")[2]} <= set(allocated)


@pytest.mark.parametrize("forbidden", [("udp dport 1-65535",), ("udp dport 1-65535", "tcp dport 3478")])
def test_where_firewalls_forbid_udp_they_meet_by_tcp_and_tls(
    nat_lab: NatLab,
    fleet: Fleet,
    coturn: Coturn,
    monkeypatch: pytest.MonkeyPatch,
    forbidding: Callable[..., None],
    forbidden: tuple[str, ...],
) -> None:
    trust(monkeypatch, coturn)
    forbidding(*forbidden)
    took_s, _ = nat_lab.on_operators_side(lambda: through(fleet))
    assert took_s < 8, "what is forbidden is not waited for"


def test_a_session_outlives_its_credentials_and_its_next_connection_gets_fresh_ones(
    nat_lab: NatLab, fleet: Fleet, coturn: Coturn, monkeypatch: pytest.MonkeyPatch
) -> None:
    trust(monkeypatch, coturn)

    said_before = len(coturn.log.read_text())  # by other tests, whose credentials live longer

    def newest_s() -> int:
        """Until when the newest credentials are good that somebody has shown."""
        return max(int(found) for found in re.findall(r"user <(\d+):", coturn.log.read_text()[said_before:]))

    async def body() -> None:
        async with await fleet.signed_in() as operator:
            connection = await operator.connect(fleet.account["robotId"], timeout_s=30)
            pose = connection.receivable("pose")
            await pose.next_message()
            ends_at_s = newest_s()
            while time.time() <= ends_at_s + 1:
                await pose.next_message(5)
            assert connection.state == "connected"
            attempt = await fleet.attempt(operator)
            assert int(attempt.issued[0].partition(":")[0]) > ends_at_s
        assert newest_s() > ends_at_s

    nat_lab.on_operators_side(body)
