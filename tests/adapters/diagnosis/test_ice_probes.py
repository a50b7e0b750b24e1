"""STUN and TURN, asked for real: a coturn on loopback, a silent port, a name that nobody knows."""

from __future__ import annotations

import asyncio
import socket
import ssl
import struct
import subprocess
from collections.abc import Coroutine, Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest

from mosaic_core.adapters.diagnosis.peer_trial import peer_trial
from mosaic_core.adapters.diagnosis.stun_probe import stun_survey
from mosaic_core.adapters.diagnosis.turn_probe import TurnAnswer, turn_probe
from mosaic_core.adapters.signaling import address_race
from mosaic_core.doctor.ice_checks import ice_checks, relay_findings
from mosaic_core.machines.diagnosis.nat_kind import nat_verdict
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.finding import Finding
from mosaic_core.words.ice import IceServer, parse_ice_url

T = TypeVar("T")
SHORT_S = 0.6
SILENT = "turn:127.0.0.1:9"


def run(work: Coroutine[Any, Any, T]) -> T:
    async def bounded() -> T:
        async with asyncio.timeout(30):
            return await work

    return asyncio.run(bounded())


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_an_allocation_is_made_and_given_back(coturn: Any, transport: str) -> None:
    answer = run(turn_probe(parse_ice_url(getattr(coturn, transport)), "me", "pass"))
    assert (answer.code, answer.problem) == ("check.ok", "")
    assert answer.relayed.startswith("127.0.0.1:")


@pytest.mark.parametrize(
    ("username", "credential", "code"),
    [("me", "wrong", "ice.turn_refused"), (None, None, "ice.turn_no_credentials")],
)
def test_refused_credentials_are_told_from_missing_ones(
    coturn: Any, username: str | None, credential: str | None, code: str
) -> None:
    assert run(turn_probe(parse_ice_url(coturn.udp), username, credential)).code == code


@pytest.mark.parametrize(
    ("url", "words"),
    [
        (SILENT, "no answer"),
        (f"{SILENT}?transport=tcp", "nothing listens"),
        ("turn:nix.invalid:1", "can't be resolved"),
    ],
)
def test_a_server_that_is_not_there_is_said_in_time(url: str, words: str) -> None:
    answer = run(turn_probe(parse_ice_url(url), "me", "pass", SHORT_S))
    assert answer.code == "ice.turn_silent"
    assert words in answer.problem
    assert answer.took_ms < 1000 * (SHORT_S + 2)


DUAL = "turn.dual.test"


@pytest.fixture
def dual_name(coturn: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A name with an IPv6 and an IPv4 address that take everything and say nothing, and coturn's own as its last."""
    known = socket.getaddrinfo
    dead = [(socket.AF_INET6, "::1"), (socket.AF_INET, "127.0.0.2")]

    def looked_up(host: Any, port: Any, family: int = 0, *more: Any, **named: Any) -> list[Any]:
        if host != DUAL:
            return known(host, port, family, *more, **named)
        found = [*dead, (socket.AF_INET, "127.0.0.1")]
        return [(one, socket.SOCK_DGRAM, 17, "", (address, 0)) for one, address in found if family in (0, one)]

    silent = []
    for family, address in dead:
        for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
            silent.append(socket.socket(family, kind))
            silent[-1].bind((address, coturn.port))
            if kind == socket.SOCK_STREAM:
                silent[-1].listen()
    monkeypatch.setattr(socket, "getaddrinfo", looked_up)
    yield f"{DUAL}:{coturn.port}"
    for one in silent:
        one.close()


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_dead_addresses_before_the_working_one_cost_no_time_and_no_socket(dual_name: str, transport: str) -> None:
    async def probed() -> tuple[list[TurnAnswer], int, int]:
        answers = [await turn_probe(parse_ice_url(f"turn:{dual_name}?transport={transport}"), "me", "pass")]
        await address_race._leaving.done()
        before = open_files()
        url = parse_ice_url(f"turn:{dual_name}?transport={transport}")
        answers += await asyncio.gather(*(turn_probe(url, "me", "pass") for _ in range(5)))
        await address_race._leaving.done()
        await asyncio.sleep(0)  # transports close in the loop's next turn
        return answers, before, open_files()

    answers, before, after = run(probed())
    assert {answer.code for answer in answers} == {"check.ok"}
    assert max(answer.took_ms for answer in answers) < 4500, "the silent ones time out after 5 s"
    assert after <= before


def test_refused_credentials_are_told_although_other_addresses_are_silent(dual_name: str) -> None:
    assert run(turn_probe(parse_ice_url(f"turn:{dual_name}"), "me", "wrong", SHORT_S)).code == "ice.turn_refused"


def test_a_stun_server_is_found_behind_dead_addresses(dual_name: str) -> None:
    survey = run(stun_survey([parse_ice_url(f"stun:{dual_name}")], SHORT_S))
    assert survey.answers[0].mapping is not None
    assert survey.answers[0].mapping.server[0] == "127.0.0.1"


def test_a_whole_connection_is_relayed_by_a_server_with_dead_addresses(dual_name: str) -> None:
    server = IceServer(urls=(f"turn:{dual_name}",), username="me", credential="pass")
    result = run(peer_trial((server,), relay_only=True))
    assert result.path is not None
    assert result.path.local_type == "relay"
    assert result.setup_ms < 4000


def test_plain_turn_where_tls_is_expected_is_a_finding_and_no_hang(coturn: Any) -> None:
    answer = run(turn_probe(parse_ice_url(f"turns:127.0.0.1:{coturn.port}"), "me", "pass", SHORT_S))
    assert answer.code in ("ice.turn_tls", "ice.turn_silent")


async def test_who_hangs_up_where_tls_begins_does_not_speak_it() -> None:
    async def hang_up(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()

    async with await asyncio.start_server(hang_up, "127.0.0.1", 0) as server:
        url = f"turns:127.0.0.1:{server.sockets[0].getsockname()[1]}"
        answer = await turn_probe(parse_ice_url(url), "me", "pass", SHORT_S)
    assert (answer.code, answer.problem) == ("ice.turn_tls", "it hangs up where TLS begins")


def test_a_certificate_that_nobody_trusts_is_told_with_its_cure(tmp_path: Path) -> None:
    words = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    words += ["-days", "2", "-subj", "/CN=turn", "-addext", "subjectAltName=IP:127.0.0.1"]
    made, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    subprocess.run([*words, "-keyout", str(key), "-out", str(made)], check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(made, key)

    async def probed() -> TurnAnswer:
        server = await asyncio.start_server(lambda *_: None, "127.0.0.1", 0, ssl=context)
        async with server:
            url = f"turns:127.0.0.1:{server.sockets[0].getsockname()[1]}"
            return await turn_probe(parse_ice_url(url), "me", "pass", SHORT_S)

    answer = run(probed())
    assert answer.code == "ice.turn_tls"
    [finding, _] = relay_findings([answer])
    assert "certificate can't be verified" in finding.sentence
    assert "SSL_CERT_FILE" in finding.cure


def test_one_socket_asks_all_stun_servers_and_their_answers_are_judged(coturn: Any) -> None:
    urls = [parse_ice_url(url) for url in (f"stun:127.0.0.1:{coturn.port}", "stun:127.0.0.1:9", "stun:nix.invalid:1")]
    survey = run(stun_survey(urls, SHORT_S))
    answered, silent, unknown = survey.answers
    assert answered.mapping is not None
    assert answered.mapping.mapped == ("127.0.0.1", survey.local_port)
    assert (silent.mapping, unknown.mapping) == (None, None)
    assert "no answer" in silent.problem
    assert "resolved" in unknown.problem
    assert nat_verdict(survey.local_port, ["127.0.0.1"], survey.mappings).kind == "none"


async def all_of(servers: tuple[IceServer, ...]) -> dict[str, list[Finding]]:
    found: dict[str, list[Finding]] = {}
    async for finding in ice_checks(servers):
        found.setdefault(finding.check, []).append(finding)
    return found


def test_a_dead_url_beside_a_working_one_is_a_warning(coturn: Any) -> None:
    found = run(all_of((IceServer(urls=(coturn.tcp, f"{SILENT}?transport=tcp"), username="me", credential="pass"),)))
    assert [one.status for one in found["ice.turn"]] == ["ok", "warn"]
    assert found["ice.relay"][0].status == "ok"


def test_the_cure_of_a_silent_protocol_is_the_one_that_answers(coturn: Any) -> None:
    silent = TurnAnswer("turn:t.example:3478?transport=udp", "ice.turn_silent", 5000.0, "no answer within 5 s")
    other = TurnAnswer("turn:t.example:3478?transport=tcp", "check.ok", 20.0, relayed="192.0.2.1:1")
    turn, relay = relay_findings([silent], [other])
    assert turn.cure == "It answers by the other protocol: add turn:t.example:3478?transport=tcp."
    assert (turn.status, relay.code) == ("fail", "ice.no_turn")


def test_without_any_server_that_is_said() -> None:
    assert [one.code for one in run(all_of(()))["ice.servers"]] == ["ice.no_servers"]


def test_a_whole_connection_goes_through_the_relay(coturn: Any) -> None:
    server = IceServer(urls=(coturn.udp,), username="me", credential="pass")
    result = run(peer_trial((server,), relay_only=True))
    assert result.path is not None
    assert (result.path.local_type, result.path.remote_type, result.path.family) == ("relay", "relay", "IPv4")
    assert result.throughput_bps > 1e6
    assert result.round_trip_ms < 1000


def test_a_connection_that_finds_no_relay_names_its_phase(coturn: Any) -> None:
    server = IceServer(urls=(coturn.udp,), username="me", credential="wrong")
    with pytest.raises(ConnectionFailed) as failed:
        run(peer_trial((server,), relay_only=True, timeout_s=3))
    assert failed.value.code in ("ice.no_relay", "ice.timeout")
