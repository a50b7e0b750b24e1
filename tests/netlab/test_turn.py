"""Through a real coturn, run with the configuration that the documentation recommends.

    robot ── NAT ── public network (server, coturn) ── NAT ── operator

Both NATs take another port for every destination (nftables, ``masquerade fully-random``), so no direct path exists.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import aioice.stun
import aioice.turn
import pytest

from mosaic_core.adapters.aiortc_answerer import aiortc_answerer
from mosaic_core.adapters.aiortc_offerer import aiortc_offerer
from mosaic_core.operator import MosaicOperator
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.ice import IceServer, IceTransportPolicy
from mosaic_server.security.turn_credentials import turn_credential

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(120)]

GUIDE = Path(__file__).parents[2] / "docs" / "howto" / "turn.md"
MOSAIC = [sys.executable, "-m", "mosaic_core.cli.main"]
SECRET = "north-of-the-wall"  # noqa: S105 - of nobody
ROBOT_WAN, OPERATOR_WAN = "198.51.100", "203.0.113"  # TEST-NET-2 and -3 (RFC 5737) play the public network
TURN_IP = f"{OPERATOR_WAN}.1"
SERVER_PORT = 9001
DEAD = f"turn:{OPERATOR_WAN}.200:3478"
URLS = {
    "udp": f"turn:{TURN_IP}:3478",
    "tcp": f"turn:{TURN_IP}:3478?transport=tcp",
    "tls": f"turns:{TURN_IP}:5349",
}
NAT_RULES = """\
table ip lab {
  chain masked { type nat hook postrouting priority 100; oifname "wan" masquerade fully-random; }
  chain forwarded {
    type filter hook forward priority 0; policy drop;
    iifname "lan" accept
    ct state established,related accept
  }
}
"""


def command(*words: str, text: str | None = None) -> str:
    done = subprocess.run(words, capture_output=True, text=True, input=text, timeout=30)
    if done.returncode != 0:
        raise OSError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


@dataclass
class NatLab:
    """The five networks by name."""

    networks: dict[str, Any]

    def on_operators_side(self, body: Callable[[], Any]) -> Any:
        return self.networks["operator"].run(lambda: asyncio.run(body()))

    def prefix(self, name: str) -> list[str]:
        return list(self.networks[name].prefix)


def _cable(one: Any, port: str, address: str, other: Any, other_port: str, other_address: str) -> None:
    command("ip", "-n", one.name, "link", "add", port, "type", "veth", "peer", "name", other_port, "netns", other.name)
    for network, name, its in ((one, port, address), (other, other_port, other_address)):
        command("ip", "-n", network.name, "addr", "add", f"{its}/24", "dev", name)
        command("ip", "-n", network.name, "link", "set", name, "up")


@pytest.fixture(scope="module")
def nat_lab(lab: Any) -> Iterator[NatLab]:
    for program, package in (("nft", "nftables"), ("turnserver", "coturn"), ("openssl", "openssl")):
        if shutil.which(program) is None:
            pytest.skip(f"no `{program}`: apt install {package}")
    names = ("robot", "robot-nat", "public", "operator-nat", "operator")
    networks = {name: type(lab.robot)(f"mosaic-{os.getpid()}-turn-{name}") for name in names}
    with ExitStack() as stack:
        for network in networks.values():
            command("ip", "netns", "add", network.name)
            stack.callback(command, "ip", "netns", "del", network.name)
            command("ip", "-n", network.name, "link", "set", "lo", "up")
        for who, lan, wan in (("robot", "192.168.1", ROBOT_WAN), ("operator", "192.168.2", OPERATOR_WAN)):
            nat = networks[f"{who}-nat"]
            _cable(nat, "lan", f"{lan}.1", networks[who], "eth0", f"{lan}.2")
            _cable(networks["public"], who, f"{wan}.1", nat, "wan", f"{wan}.11")
            command("ip", "-n", networks[who].name, "route", "add", "default", "via", f"{lan}.1")
            command("ip", "-n", nat.name, "route", "add", "default", "via", f"{wan}.1")
            command(*nat.prefix, "nft", "-f", "-", text=NAT_RULES)
        for name in ("robot-nat", "public", "operator-nat"):
            networks[name].run(lambda: Path("/proc/sys/net/ipv4/ip_forward").write_text("1"))
        yield NatLab(networks)


def started(stack: ExitStack, words: list[str], log: Path, **environment: str) -> subprocess.Popen[bytes]:
    with log.open("wb") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT, env={**os.environ, **environment})

    def stop() -> None:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(5)

    stack.callback(stop)
    return process


def recommended() -> str:
    """The configuration in the guide, as it stands."""
    found = re.search(r"```ini\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("certificate")
    cert, key = folder / "cert.pem", folder / "key.pem"
    words = f"openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN={TURN_IP}"
    command(*words.split(), "-addext", f"subjectAltName=IP:{TURN_IP}", "-out", str(cert), "-keyout", str(key))
    return cert, key


@pytest.fixture(scope="module")
def coturn(
    nat_lab: NatLab,
    certificate: tuple[Path, Path],
    tmp_path_factory: pytest.TempPathFactory,
    wait_for: Callable[..., float],
) -> Iterator[Path]:
    """Its log."""
    folder = tmp_path_factory.mktemp("coturn")
    text = recommended().replace("REPLACE-ME", SECRET)
    text = text.replace("/etc/coturn/cert.pem", str(certificate[0])).replace("/etc/coturn/key.pem", str(certificate[1]))
    config, log = folder / "turnserver.conf", folder / "log"
    config.write_text(text)
    with ExitStack() as stack:
        own = ["--listening-ip", TURN_IP, "--relay-ip", TURN_IP, "--userdb", str(folder / "db")]
        files = ["--pidfile", str(folder / "pid"), "--log-file", str(log), "--simple-log", "--verbose"]
        words = [*nat_lab.prefix("public"), "turnserver", "-c", str(config), *own, *files]
        process = started(stack, words, folder / "output")
        sockets = [*nat_lab.prefix("public"), "ss", "-Hlntu"]
        wait_for(
            lambda: len(re.findall(rf"{re.escape(TURN_IP)}:(?:3478|5349)\b", command(*sockets))) >= 4,
            "coturn listens",
            alive=process,
            log=[],
        )
        yield log


def servers(*urls: str, lifetime_s: float = 600, later_s: float = 0.0) -> tuple[IceServer, ...]:
    credential = turn_credential(SECRET, "rover", time.time() + later_s, lifetime_s)
    return (IceServer(urls=urls, username=credential.username, credential=credential.password),)


class Ear:
    """Listens at one end of a peer connection, for messages only."""

    def __init__(self) -> None:
        self.heard: asyncio.Queue[bytes | str] = asyncio.Queue()

    def channel_opened(self, channel: Any) -> None:
        channel.on_message = self.heard.put_nowait

    def __getattr__(self, name: str) -> Any:
        return lambda *_args, **_options: None


async def offered(ice_servers: tuple[IceServer, ...]) -> tuple[str, float]:
    """A description with relayed candidates only, and how long it took."""
    offerer = aiortc_offerer(Ear(), ice_servers, relay_only=True)
    offerer.create_channel("x")
    start_s = time.monotonic()
    try:
        sdp, _ = await offerer.offer()
        return sdp, time.monotonic() - start_s
    finally:
        await offerer.close()


def trust(monkeypatch: pytest.MonkeyPatch, certificate: tuple[Path, Path]) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate[0]))


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
    nat_lab: NatLab, way: str, monkeypatch: pytest.MonkeyPatch, certificate: tuple[Path, Path]
) -> None:
    trust(monkeypatch, certificate)
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
    assert took_s < 1


@pytest.mark.usefixtures("coturn")
def test_expired_credentials_are_refused_and_fresh_ones_work(nat_lab: NatLab) -> None:
    with pytest.raises(ConnectionFailed) as failed:
        nat_lab.on_operators_side(lambda: offered(servers(URLS["udp"], later_s=-660)))
    assert failed.value.code == "ice.no_relay"
    sdp, _ = nat_lab.on_operators_side(lambda: offered(servers(URLS["udp"])))
    assert " typ relay" in sdp


@pytest.mark.usefixtures("coturn")
def test_a_live_connection_outlives_its_credentials(nat_lab: NatLab) -> None:
    async def body() -> None:
        given = servers(URLS["udp"], lifetime_s=4)
        ends_at_s = int((given[0].username or "").partition(":")[0])
        mine, theirs = Ear(), Ear()
        offerer = aiortc_offerer(mine, given, relay_only=True)
        answerer = aiortc_answerer(theirs, given, relay_only=True)
        try:
            channel, opened = offerer.create_channel("x"), asyncio.Event()
            channel.on_open = opened.set
            sdp, _ = await offerer.offer()
            await offerer.accept_answer(await answerer.answer(sdp, [], None))
            async with asyncio.timeout(20):
                await opened.wait()
                while time.time() <= ends_at_s + 2:
                    channel.send("still here")
                    assert await theirs.heard.get() == "still here"
                    await asyncio.sleep(0.2)
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


@dataclass
class Fleet:
    """A server in the public network that issues the credentials, and a robot behind its NAT."""

    account: dict[str, str]

    async def connected_s(self, policy: IceTransportPolicy) -> tuple[float, list[str]]:
        """How long it took from the wish until data came, and the usernames that the operator was issued."""
        url = f"http://{TURN_IP}:{SERVER_PORT}"
        async with await MosaicOperator.login(url, self.account["email"], self.account["password"]) as operator:
            operator.ice_transport_policy = policy
            start_s = time.monotonic()
            connection = await operator.connect(self.account["robotId"], timeout_s=30)
            await connection.receivable("pose").next_message()
            issued = [one.username or "" for one in await operator.rest.ice_servers()]
            return time.monotonic() - start_s, issued


@pytest.fixture(scope="module")
def fleet(
    nat_lab: NatLab,
    coturn: Path,
    certificate: tuple[Path, Path],
    tmp_path_factory: pytest.TempPathFactory,
    wait_for: Callable[..., float],
) -> Iterator[Fleet]:
    folder = tmp_path_factory.mktemp("fleet")
    data = ["--data-dir", str(folder)]
    account = json.loads(command(*MOSAIC, "server", "seed", *data, "--robot-name", "Lab robot", "--json"))
    (folder / "secret").write_text(SECRET)
    urls = [DEAD, *URLS.values()]
    command(*MOSAIC, "server", "ice", "add", *urls, "--secret-file", str(folder / "secret"), *data)
    robot_ip = f"{ROBOT_WAN}.1"
    with ExitStack() as stack:
        ready = folder / "ready.json"
        words = ["server", "run", "--host", "0.0.0.0", "--port", str(SERVER_PORT), "--insecure-public", *data]  # noqa: S104
        hosts = ["--allow-host", robot_ip, "--allow-host", TURN_IP, "--ready-file", str(ready)]
        server = started(stack, [*nat_lab.prefix("public"), *MOSAIC, *words, *hosts], folder / "server.log")
        wait_for(lambda: ready.exists() and bool(ready.read_text()), "the server listens", alive=server, log=[])
        config = folder / "mosaic_config.yaml"
        config.write_text(f"""\
version: 1
server:
  ws_url: ws://{robot_ip}:{SERVER_PORT}
  auth: {{ type: simple-token, robot_id: {account["robotId"]}, params: {{ token: {account["robotToken"]} }} }}
connectors:
  - {{ type: sim-pose, label: pose, params: {{ period_s: 0.05 }} }}
""")
        log = folder / "robot.log"
        words = [*nat_lab.prefix("robot"), *MOSAIC, "run", str(config), "--json"]
        robot = started(stack, words, log, SSL_CERT_FILE=str(certificate[0]))
        is_ready = re.compile(r'"state": ?"ready"')
        wait_for(lambda: is_ready.search(log.read_text()) is not None, "the robot is ready", alive=robot, log=[])
        yield Fleet(account)
        assert SECRET not in (folder / "server.log").read_text() + log.read_text()


@pytest.mark.parametrize("policy", ["all", "relay"])
def test_with_symmetric_nat_on_both_sides_they_meet_at_the_relay(
    nat_lab: NatLab,
    fleet: Fleet,
    coturn: Path,
    monkeypatch: pytest.MonkeyPatch,
    certificate: tuple[Path, Path],
    policy: IceTransportPolicy,
) -> None:
    trust(monkeypatch, certificate)
    took_s, issued = nat_lab.on_operators_side(lambda: fleet.connected_s(policy))
    assert took_s < 5, "the first URL is dead, and waiting for one takes that long"
    assert re.fullmatch(r"\d+:[0-9a-f-]{36}", issued[0])
    allocated = re.findall(r"user <\d+:([0-9a-f-]{36})>", coturn.read_text())
    assert {fleet.account["robotId"], issued[0].partition(":")[2]} <= set(allocated)
