"""Hostile, slow, dead and doubled sockets against the real server."""

from __future__ import annotations

import contextlib
import json
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from uuid import uuid4

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from mosaic_server.settings import Settings
from mosaic_server.sockets.keep_alive import KeepAlivePeriods
from mosaic_server.storage.grants import Actor
from mosaic_server.storage.members import shut_out
from mosaic_server.storage.robots import renew_token

OURS = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
OFFER = "signaling.send_sdp_offer"


@pytest.fixture
def impatient_server(settings: Settings, start_server: Callable[..., Any]) -> Iterator[Any]:
    """It waits for no log-in longer than a second, and for no word longer than one and a half."""
    hasty = KeepAlivePeriods(ping_s=0.3, silence_s=1.5, check_s=0.1)
    with start_server(replace(settings, keep_alive=hasty, authorize_within_s=1.0)) as running:
        yield running


def joined(server: Any, *, ours: bool = True) -> tuple[Any, Any, str, str]:
    """A robot, an operator that subscribed to it, the access token and the robot's id."""
    person = server.account()
    robot_id, robot_token = server.robot(person)
    robot = server.connect_robot(robot_id, robot_token, OURS if ours else None)
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token, OURS if ours else None)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass
    return robot, user, token, robot_id


def connected(server: Any, token: str, robot: Any, user: Any, robot_id: str) -> str:
    answer = server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]})
    connection_id: str = answer.json()["resultData"]["sessions"][0]["rtcSessionId"]
    robot.expect("signaling.prepare_connection")
    user.send(OFFER, {"rtcConnectionId": connection_id, "sdpOffer": "v=0"})
    robot.expect(OFFER)
    return connection_id


@pytest.mark.parametrize("path", ["/ws/robot", "/ws/user"])
def test_a_large_frame_before_authorization_closes_with_4413(server: Any, path: str) -> None:
    party = server.open(path)
    party.expect("authorize.req")
    party.connection.send("x" * 9000)
    assert party.close_code() == 4413


def test_an_offer_of_200_kib_passes_and_one_of_300_closes_with_4413(server: Any) -> None:
    robot, user, token, robot_id = joined(server)
    connection_id = connected(server, token, robot, user, robot_id)
    user.send(OFFER, {"rtcConnectionId": connection_id, "sdpOffer": "o" * 200_000})
    assert len(robot.expect(OFFER)["sdpOffer"]) == 200_000
    user.send(OFFER, {"rtcConnectionId": connection_id, "sdpOffer": "o" * 300_000})
    assert user.close_code() == 4413
    robot.status(2)  # nobody else is disturbed


@pytest.mark.parametrize("path", ["/ws/robot", "/ws/user"])
def test_a_socket_that_does_not_authorize_is_closed_with_4408(impatient_server: Any, path: str) -> None:
    party = impatient_server.open(path)
    assert party.close_code() == 4408


@pytest.mark.parametrize("frame", ["{broken", b"\x00\x01", '{"type":5}', "[]", "[" * 3000, '"text"', "null"])
def test_malformed_frames_are_echoed_and_repeated_ones_close_with_4400(server: Any, frame: str | bytes) -> None:
    server.account()
    user = server.connect_operator(server.log_in())
    for _ in range(5):
        user.connection.send(frame)
        assert user.expect("unknown") == 10001
    user.connection.send(frame)
    assert user.close_code() == 4400


def test_wrong_tokens_close_with_4401(server: Any) -> None:
    robot_id, _ = server.robot(server.account())
    robot = server.open("/ws/robot")
    for _ in range(5):
        robot.send("authorize", {"robotId": robot_id, "data": "mrt_wrong"})
    assert robot.close_code() == 4401


def test_two_robots_with_one_identity_the_newest_wins_and_the_other_gets_4409(server: Any) -> None:
    robot_id, robot_token = server.robot(server.account())
    old = server.connect_robot(robot_id, robot_token)
    new = server.connect_robot(robot_id, robot_token)
    assert old.close_code() == 4409
    token = server.log_in()
    new.status(0)
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    assert user.expect("status.update")["status"] in (6, 0), "the end of the old one didn't mark the robot as gone"


def test_a_talker_beyond_the_rate_is_closed_with_4429(server: Any) -> None:
    server.account()
    user = server.connect_operator(server.log_in())
    text = json.dumps({"type": "status.subscribe", "data": {"robotIds": []}})
    with contextlib.suppress(ConnectionClosed):
        for _ in range(2000):
            user.connection.send(text)
    assert user.close_code() == 4429


def test_a_client_that_reads_nothing_is_evicted_and_the_others_go_on(server: Any) -> None:
    robot, user, token, robot_id = joined(server)
    entry = {"label": "x" * 200_000, "type": "t", "dataType": "json-r2u", "direction": "to-operator"}
    robot.send("catalogue.announce", {"catalogue": {"hash": "h", "entries": [entry]}})
    user.expect("catalogue.update")
    slow = RawClient(server, "/ws/user", receive_buffer_bytes=4096)
    slow.send("authorize", {"accessToken": token, "extensions": OURS})
    slow.read_until("session.welcome")
    for _ in range(60):  # asks for 12 MB and reads nothing of it
        slow.send("status.subscribe", {"robotIds": [robot_id]})
    robot.status(1)
    assert user.expect("status.update")["status"] == 1
    slow.expect_cut_off()


class RawClient:
    """A WebSocket client without a mind of its own: it answers no ping and reads only when told to."""

    def __init__(self, server: Any, path: str, receive_buffer_bytes: int | None = None) -> None:
        self.socket = socket.socket()
        if receive_buffer_bytes:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        self.socket.settimeout(5)
        self.socket.connect(("127.0.0.1", server.listening.port))
        self.socket.sendall(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        self.seen = b""
        self.read_until("authorize.req")

    def send(self, kind: str, data: Any) -> None:
        payload = json.dumps({"type": kind, "data": data}).encode()
        assert len(payload) < 65536
        size = bytes([0x80 | len(payload)]) if len(payload) < 126 else b"\xfe" + len(payload).to_bytes(2, "big")
        self.socket.sendall(b"\x81" + size + b"\0\0\0\0" + payload)

    def read_until(self, word: str) -> None:
        while word.encode() not in self.seen:
            self.seen += self.socket.recv(4096)

    def expect_cut_off(self, within_s: float = 10) -> None:
        """Reads what was under way until the server's end of the TCP connection."""
        deadline = time.monotonic() + within_s
        try:
            while self.socket.recv(65536):
                assert time.monotonic() < deadline
        except ConnectionResetError:
            pass
        self.socket.close()


def test_a_dead_robot_is_noticed_although_tcp_says_nothing(impatient_server: Any) -> None:
    person = impatient_server.account()
    robot_id, robot_token = impatient_server.robot(person)
    dead = RawClient(impatient_server, "/ws/robot")
    dead.send("authorize", {"robotId": robot_id, "data": robot_token})
    dead.read_until("authorize.res")
    user = impatient_server.connect_operator(impatient_server.log_in())
    user.send("status.subscribe", {"robotIds": [robot_id]})
    assert user.expect("status.update")["status"] == 6
    assert user.expect("status.update")["status"] == 5, "no pong for silence_s means dead"
    dead.expect_cut_off()


def test_a_c1_robot_stays_with_pongs_alone(impatient_server: Any) -> None:
    robot, user, *_ = joined(impatient_server, ours=False)
    deadline_s = time.monotonic() + 2.5
    pings = 0
    while time.monotonic() < deadline_s:  # the library answers the ping frames, nobody answers ping.ping
        pings += robot.receive()["type"] == "ping.ping"
    assert pings >= 3
    robot.status(1)
    assert user.expect("status.update")["status"] == 1


def test_a_renewed_token_puts_the_robot_off_even_from_another_process(server: Any) -> None:
    robot, user, _, robot_id = joined(server)
    server.work(renew_token, robot_id)
    assert robot.close_code() == 4401
    assert user.expect("status.update")["status"] == 5


def test_a_disabled_account_loses_its_sockets_and_its_log_in(server: Any) -> None:
    person = server.account()
    token = server.log_in()
    user = server.connect_operator(token)
    server.work(shut_out, person.id, False, Actor("test"))
    assert user.close_code() == 4401
    assert server.get("/api/v1/users/me", token).status_code == 401


def test_order_is_kept_from_one_socket_to_the_other(server: Any) -> None:
    robot, user, token, robot_id = joined(server)
    connection_id = connected(server, token, robot, user, robot_id)
    for number in range(200):
        candidate = {"candidate": str(number), "sdpMid": "0", "sdpMLineIndex": 0}
        user.send("signaling.exchange_ice_candidate", {"rtcConnectionId": connection_id, "iceCandidate": candidate})
    got = [robot.expect("signaling.exchange_ice_candidate")["iceCandidate"]["candidate"] for _ in range(200)]
    assert got == [str(number) for number in range(200)]


def test_catalogues_reach_operators_and_survive_the_robot(server: Any) -> None:
    robot, user, token, robot_id = joined(server)
    entry = {
        "label": "battery",
        "type": "battery",
        "kind": "data",
        "dataType": "json-r2u",
        "direction": "to-operator",
        "channels": [{"label": "battery", "dataType": "json-r2u"}],
        "delivery": "reliable",
    }
    robot.send("catalogue.announce", {"catalogue": {"hash": "h", "entries": [entry | {"messageSchema": {"a": 1}}]}})
    update = user.expect("catalogue.update")
    assert update == {"robotId": robot_id, "catalogue": {"hash": "h", "entries": [entry]}}
    robot.connection.close()
    assert user.expect("status.update")["status"] == 5
    answer = server.get(f"/api/v1/robots/{robot_id}/catalogue", token).json()
    assert answer == {"resultCode": 100, "resultData": {"hash": "h", "entries": [entry]}}


def test_after_a_restart_robots_operators_catalogues_and_sessions_come_back(
    settings: Any, start_server: Callable[..., Any]
) -> None:
    with start_server(settings) as server:
        robot, user, token, robot_id = joined(server)
        robot.send("catalogue.announce", {"catalogue": {"hash": "h", "entries": []}})
        user.expect("catalogue.update")
        session = server.post("/api/v1/webrtc/connection", token, {"robotIds": [robot_id]}).json()
        session_id = session["resultData"]["sessions"][0]["sessionId"]
        robot_token = server.work(renew_token, robot_id)
        started_s = time.monotonic()
        server.server.should_exit = True
        assert user.close_code() == 1001, "tells everybody to come back"
        port = server.listening.port
    assert time.monotonic() - started_s < 10
    with start_server(settings, port) as server:
        robot = server.connect_robot(robot_id, robot_token, OURS)
        user = server.connect_operator(token, OURS)
        user.send("status.subscribe", {"robotIds": [robot_id]})
        user.expect("status.update")
        assert user.expect("catalogue.update")["catalogue"]["hash"] == "h"
        body = {"robotIds": [robot_id], "sessionId": session_id}
        again = server.post("/api/v1/webrtc/connection", token, body)
        assert again.json()["resultData"]["sessions"][0]["sessionId"] == session_id


def test_foreign_pages_may_not_open_a_socket(server: Any) -> None:
    with pytest.raises(InvalidStatus) as refused:
        server.open("/ws/user", origin="https://evil.example")
    assert refused.value.response.status_code == 403
    own = f"http://127.0.0.1:{server.listening.port}"
    server.open("/ws/user", origin=own).expect("authorize.req")


def test_no_compression_is_negotiated(server: Any) -> None:
    party = server.open("/ws/user", additional_headers={"Sec-WebSocket-Extensions": "permessage-deflate"})
    assert "Sec-WebSocket-Extensions" not in party.connection.response.headers


def test_a_robot_that_talks_into_strangers_connections_is_refused(server: Any) -> None:
    robot, user, token, robot_id = joined(server)
    connection_id = connected(server, token, robot, user, robot_id)
    other_id, other_token = server.robot(server.account("eve@example.org"))
    other = server.connect_robot(other_id, other_token, OURS)
    other.send("signaling.send_sdp_answer", {"rtcConnectionId": connection_id, "sdpAnswer": "evil"})
    assert other.expect("signaling.send_sdp_answer") == 10020
    other.send("signaling.send_sdp_answer", {"rtcConnectionId": str(uuid4()), "sdpAnswer": "evil"})
    assert other.expect("signaling.send_sdp_answer") == 10053
    user.expect_silence()
