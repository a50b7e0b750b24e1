"""Strangers who hold connections, dawdle and flood, against the real server over real sockets."""

from __future__ import annotations

import contextlib
import logging
import socket
import ssl
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import InvalidStatus

from mosaic_server.entrance.bounds import Bounds
from mosaic_server.entrance.forwarded import ProxyHeader
from mosaic_server.settings import Settings

HEALTH = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
StartServer = Callable[..., Any]


def dial(server: Any, first: bytes = b"") -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", server.listening.port), timeout=10)
    connection.sendall(first)
    return connection


def is_closed(connection: socket.socket) -> bool:
    """Waits until the server says something or closes."""
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def is_answered(server: Any) -> bool:
    with contextlib.closing(dial(server, HEALTH)) as connection:
        try:
            return connection.recv(100).startswith(b"HTTP/1.1 200")
        except ConnectionError:
            return False


def test_idle_connections_keep_nobody_out(start_server: StartServer, settings: Settings) -> None:
    bounded = replace(settings, bounds=Bounds(connections_per_address=5))
    with start_server(bounded) as server, contextlib.ExitStack() as stack:
        held = [stack.enter_context(dial(server)) for _ in range(20)]
        assert is_answered(server)
        assert all(map(is_closed, held[:15])), "the oldest made room"
        held[-1].sendall(HEALTH)
        assert held[-1].recv(12) == b"HTTP/1.1 200"


def test_sockets_of_one_address_are_bounded_and_the_log_says_so(
    start_server: StartServer, settings: Settings, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, "mosaic_server.entrance")
    with start_server(replace(settings, bounds=Bounds(connections_per_address=3))) as server:
        parties = [server.open("/ws/user") for _ in range(3)]
        for party in parties:
            party.expect("authorize.req")
        assert not any(is_answered(server) for _ in range(5))
        parties[0].connection.close()
        deadline_s = time.monotonic() + 10
        while not is_answered(server):
            assert time.monotonic() < deadline_s
    refused = [record.getMessage() for record in caplog.records if record.name == "mosaic_server.entrance.refusals"]
    assert refused == ["refused a connection (its address holds as many as it may) from 127.0.0.1"]


@pytest.mark.parametrize(
    "said",
    [b"", b"GET / HTTP/1.1\r\nHo", HEALTH + b"GET /hea", b"POST /api/v1/account/signup HTTP/1.1\r\nHost: a\r\n"],
    ids=["nothing", "half a head", "half a second head", "no end of the head"],
)
def test_a_head_has_to_come_within_its_time(start_server: StartServer, settings: Settings, said: bytes) -> None:
    bounds = Bounds(header_s=0.2, silence_s=60.0)
    with start_server(replace(settings, bounds=bounds)) as server, dial(server, said) as connection:
        connection.settimeout(10)
        with contextlib.suppress(ConnectionError):
            while connection.recv(4096):
                pass


def test_a_body_that_stops_coming_ends_its_connection(start_server: StartServer, settings: Settings) -> None:
    head = b"POST /api/v1/account/signup HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{"
    bounds = Bounds(header_s=60.0, silence_s=0.2)
    with start_server(replace(settings, bounds=bounds)) as server, dial(server, head) as connection:
        assert is_closed(connection)


def test_a_body_in_crumbs_ends_its_connection(
    start_server: StartServer, settings: Settings, caplog: pytest.LogCaptureFixture
) -> None:
    head = b"POST /api/v1/account/signup HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    with start_server(settings) as server:
        with dial(server, head + b"1\r\n{\r\n" * 100) as connection:
            assert is_closed(connection)
        with dial(server, head + b"200\r\n" + b" " * 512 + b"\r\n" + b"1\r\n{\r\n" * 60 + b"0\r\n\r\n") as connection:
            assert connection.recv(8) == b"HTTP/1.1", "some small pieces are nothing strange"
        with dial(server, head + (b"200\r\n" + b" " * 512 + b"\r\n") * 200 + b"0\r\n\r\n") as connection:
            assert connection.recv(8) == b"HTTP/1.1", "nor are many that hold something"
    refused = [record.getMessage() for record in caplog.records if record.name == "mosaic_server.entrance.refusals"]
    assert refused == ["refused a body (it comes in crumbs) from 127.0.0.1"]


@pytest.mark.parametrize("line_end", [b"\r\n", b"\n"])
@pytest.mark.parametrize(("headers", "status"), [(100, b"200"), (101, b"400")])
def test_a_head_with_too_many_headers_is_not_read(
    start_server: StartServer, settings: Settings, headers: int, status: bytes, line_end: bytes
) -> None:
    lines = [b"GET /healthz HTTP/1.1", b"Host: 127.0.0.1", *[b"a: b"] * (headers - 1), b"", b""]
    with start_server(settings) as server, dial(server, line_end.join(lines)) as connection:
        assert connection.recv(12) == b"HTTP/1.1 " + status


def test_lines_of_a_body_are_no_headers(start_server: StartServer, settings: Settings) -> None:
    body = b"{" + b"\n" * 300 + b"}"
    head = b"POST /api/v1/account/signup HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    request = head + b"Content-Length: %d\r\n\r\n" % len(body) + body
    with start_server(settings) as server, dial(server, request) as connection:
        assert b"rest.bad_request" in connection.recv(4096)


def test_a_slow_answer_is_no_silence(start_server: StartServer, settings: Settings) -> None:
    """Time-outs are of the client's part alone: here the answer waits for the turn of its address."""
    bounds = Bounds(header_s=0.2, silence_s=0.2, requests_per_s=1.0, request_burst=1.0)
    with start_server(replace(settings, bounds=bounds)) as server, dial(server, HEALTH) as connection:
        assert connection.recv(12) == b"HTTP/1.1 200"
        assert is_answered(server)


def test_whoever_asks_too_often_waits_and_then_is_refused(start_server: StartServer, settings: Settings) -> None:
    with start_server(replace(settings, bounds=Bounds(requests_per_s=0.05, request_burst=2.0))) as server:
        assert [server.http.get("/healthz").status_code for _ in range(2)] == [200, 200]
        answer = server.http.get("/healthz")
        assert answer.status_code == 429
        assert int(answer.headers["Retry-After"]) in range(10, 21)
        with pytest.raises(InvalidStatus) as refused:
            server.open("/ws/user")
        assert refused.value.response.status_code == 429


FRAMES = {
    "pings": b"\x89\x84\0\0\0\0ping",
    "pongs": b"\x8a\x84\0\0\0\0pong",
    "parts of a message": b"\x00\x80\0\0\0\0",
}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
def test_frames_that_are_no_messages_count_against_the_rate(server: Any, frame: bytes) -> None:
    server.account()
    user = server.connect_operator(server.log_in())
    start = b"\x01\x80\0\0\0\0" if frame == FRAMES["parts of a message"] else b""
    with contextlib.suppress(OSError):
        user.connection.socket.sendall(start + frame * 3000)
    assert user.close_code() == 4429


def test_a_socket_that_has_not_logged_in_may_say_little(server: Any) -> None:
    party = server.open("/ws/robot")
    party.expect("authorize.req")
    with contextlib.suppress(OSError):
        party.connection.socket.sendall(FRAMES["pings"] * 200)
    assert party.close_code() == 4429


def test_a_flood_costs_the_loop_a_slice_and_no_more(server: Any) -> None:
    """What comes behind the frame that was too many is not even read as frames."""
    party = server.open("/ws/user")
    party.expect("authorize.req")
    (protocol,) = [one for one in server.server.server_state.connections if hasattr(one, "rate")]
    seen = []
    real = protocol.conn.recv_frame
    protocol.conn.recv_frame = lambda frame: (seen.append(frame), real(frame))
    with contextlib.suppress(OSError):
        party.connection.socket.sendall(FRAMES["pings"] * 20_000)
    assert party.close_code() == 4429
    assert len(seen) <= 50 + 2048 // len(FRAMES["pings"]) + 1


def test_a_handshake_that_never_comes_holds_a_place_for_its_time_only(
    start_server: StartServer, settings: Settings, certificate: tuple[Path, Path]
) -> None:
    trusting = ssl.create_default_context()
    trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE
    bounds = Bounds(connections_per_address=5, header_s=2.0)
    tls = {"ssl_certfile": certificate[0], "ssl_keyfile": certificate[1]}
    with start_server(replace(settings, bounds=bounds), **tls) as server, contextlib.ExitStack() as stack:
        held = [stack.enter_context(dial(server)) for _ in range(20)]
        base_url = f"https://127.0.0.1:{server.listening.port}"
        with httpx.Client(base_url=base_url, verify=trusting, timeout=10) as http:
            assert [http.get("/healthz").status_code for _ in range(3)] == [200] * 3
            page = http.get("/healthz")
            assert "Content-Security-Policy" in page.headers
        assert all(map(is_closed, held))


def test_nobody_speaks_for_others_but_a_proxy_that_was_named(
    start_server: StartServer, settings: Settings, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, "mosaic_server")
    spent = Bounds(requests_per_s=0.05, request_burst=1.0)

    def answers(trusted: tuple[str, ...]) -> list[int]:
        with start_server(replace(settings, bounds=spent, trusted_proxies=trusted)) as server:
            people = ("192.0.2.1", "192.0.2.2, 127.0.0.1")
            return [server.http.get("/healthz", headers={"X-Forwarded-For": one}).status_code for one in people]

    assert answers(("127.0.0.1",)) == [200, 200]
    assert "X-Forwarded-For" not in caplog.text
    assert answers(()) == [200, 429], "they count as one"
    (told,) = [message for message in caplog.messages if "X-Forwarded-For" in message]
    assert "name it with --trusted-proxy 127.0.0.1" in told


@pytest.mark.parametrize("header", ProxyHeader)
def test_one_header_is_read_and_never_the_other(
    start_server: StartServer, settings: Settings, header: ProxyHeader
) -> None:
    """The proxy writes one; a stranger writes another address into the other one with every request."""
    settings = replace(
        settings,
        bounds=Bounds(requests_per_s=0.05, request_burst=1.0),
        trusted_proxies=("127.0.0.1",),
        proxy_header=header,
    )

    def headers(of_proxy: str, of_stranger: str) -> dict[str, str]:
        simple, forwarded = (
            (of_proxy, of_stranger) if header is ProxyHeader.X_FORWARDED_FOR else (of_stranger, of_proxy)
        )
        return {"X-Forwarded-For": simple, "Forwarded": f'for="{forwarded}"'}

    with start_server(settings) as server:
        said = [headers("192.0.2.1", f"203.0.113.{number}") for number in range(2)]
        said.append(headers("192.0.2.2", "203.0.113.1"))
        assert [server.http.get("/healthz", headers=one).status_code for one in said] == [200, 429, 200]


def test_a_named_proxy_that_writes_the_other_header_is_told_in_the_log(
    start_server: StartServer, settings: Settings, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, "mosaic_server")
    with start_server(replace(settings, trusted_proxies=("127.0.0.1",))) as server:
        for _ in range(2):
            server.http.get("/healthz", headers={"Forwarded": "for=192.0.2.1"})
    (told,) = [message for message in caplog.messages if "Forwarded" in message]
    assert "--proxy-header forwarded" in told


def test_connections_of_a_named_proxy_are_not_counted_as_one_address(
    start_server: StartServer, settings: Settings
) -> None:
    bounded = replace(settings, bounds=Bounds(connections_per_address=2), trusted_proxies=("127.0.0.0/8",))
    with start_server(bounded) as server:
        for _ in range(4):
            server.open("/ws/user").expect("authorize.req")
        assert is_answered(server)
