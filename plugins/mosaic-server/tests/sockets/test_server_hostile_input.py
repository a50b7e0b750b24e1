"""Input that nobody sends by accident: it is refused in words and hurts nobody else."""

from __future__ import annotations

import base64
import contextlib
import json
import socket
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from mosaic_server.settings import Settings


def _announcing(safety_json: str) -> str:
    entry = {"label": "a", "type": "t", "dataType": "json-r2u", "direction": "to-operator", "safety": {"a": "HERE"}}
    message = {"type": "catalogue.announce", "data": {"catalogue": {"hash": "x", "entries": [entry]}}}
    return json.dumps(message).replace('"HERE"', safety_json)


@pytest.mark.parametrize("safety_json", ['"\\ud800"', "[" * 300 + "]" * 300], ids=["half a pair", "too deep"])
def test_a_catalogue_that_cannot_be_sent_on_is_refused_and_operators_never_meet_it(
    server: Any, safety_json: str
) -> None:
    person = server.account()
    access_token = server.log_in()
    robot_id, token = server.robot(person)
    robot = server.connect_robot(robot_id, token, {"catalogue": 1})
    robot.connection.send(_announcing(safety_json))
    assert robot.expect("catalogue.announce.res") == 10000
    operator = server.connect_operator(access_token, {"catalogue": 1})
    operator.send("status.subscribe", {"robotIds": [robot_id]})
    assert operator.expect("status.update")["status"] == 6
    operator.expect_silence()
    assert server.get(f"/api/v1/robots/{robot_id}/catalogue", access_token).json()["resultData"] is None


@pytest.mark.parametrize("path", ["/ws/robot", "/ws/user"])
def test_half_a_surrogate_pair_is_no_message_whatever_it_stands_for(server: Any, path: str) -> None:
    suffix = ".res" if path == "/ws/robot" else ""
    party = server.open(path)
    party.expect("authorize.req")
    party.connection.send('{"type":"\\ud800"}')
    assert party.expect(f"unknown{suffix}") == 10001
    party.connection.send('{"type":"authorize","data":{"robotId":"x","data":"\\ud800","accessToken":"\\ud800"}}')
    assert party.expect("authorize.res") == 10000


def test_a_client_that_pings_and_never_reads_is_cut_off(start_server: Callable[..., Any], settings: Settings) -> None:
    """Pongs are written below the application; unread ones would fill the memory, even before authorization."""
    with (
        start_server(replace(settings, authorize_within_s=60.0)) as server,
        socket.create_connection(("127.0.0.1", server.listening.port), timeout=10) as client,
    ):
        key = base64.b64encode(b"0" * 16).decode()
        client.sendall(
            f"GET /ws/user HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        assert client.recv(4096).startswith(b"HTTP/1.1 101")
        pings = (b"\x89\xfd\0\0\0\0" + b"x" * 125) * 1000
        answered_bytes = 0
        with contextlib.suppress(ConnectionError):
            client.sendall(pings * 300)
            while answer := client.recv(65536):
                answered_bytes += len(answer)
        assert answered_bytes < 100_000, "39 MB were sent; beyond its rate nobody gets a pong"
