"""Scripted original robots and dashboards against the real server, strict about keys."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import pytest

from mosaic_server.storage.robots import RobotAuthType

CANDIDATE = {"candidate": "candidate:1 1 udp 1 192.0.2.1 5000 typ host", "sdpMid": "0", "sdpMLineIndex": 0}
CONNECTION = "/api/v1/webrtc/connection"


def made(server: Any, token: str, robot_id: str) -> str:
    answer = server.post(CONNECTION, token, {"robotIds": [robot_id]})
    assert answer.status_code == 200, answer.text
    return answer.json()["resultData"]["sessions"][0]["rtcSessionId"]


def test_a_c2_robot_and_an_s2_dashboard_connect_and_part(server: Any) -> None:
    person = server.account()
    robot_id, robot_token = server.robot(person)
    robot = server.open("/ws/robot")
    robot.expect("authorize.req")
    robot.status(0)  # C++ robots repeat their state before they authorize
    robot.send("authorize", {"robotId": robot_id, "data": robot_token})
    assert robot.expect("authorize.res") == 100

    token = server.log_in()
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    assert user.expect("status.update") == {"robotId": robot_id, "status": 0}

    answer = server.post(CONNECTION, token, {"robotIds": [robot_id]})
    session = answer.json()["resultData"]["sessions"][0]
    assert session["robotId"] == robot_id
    connection_id = session["rtcSessionId"]
    assert robot.expect("signaling.prepare_connection") == {"rtcConnectionId": connection_id}

    offer = {"rtcConnectionId": connection_id, "sdpOffer": "v=0 offer"}
    user.send("signaling.send_sdp_offer", offer | {"tracks": {"0": "front"}})
    assert robot.expect("signaling.send_sdp_offer") == offer, "an original robot gets exactly the original keys"
    robot.status(1)
    assert user.expect("status.update") == {"robotId": robot_id, "status": 1}
    answer = {"rtcConnectionId": connection_id, "sdpAnswer": "v=0 answer"}
    robot.send("signaling.send_sdp_answer", answer)
    assert user.expect("signaling.send_sdp_answer") == answer

    candidate = {"rtcConnectionId": connection_id, "iceCandidate": CANDIDATE}
    user.send("signaling.exchange_ice_candidate", candidate | {"iceCandidate": CANDIDATE | {"usernameFragment": "x"}})
    assert robot.expect("signaling.exchange_ice_candidate") == candidate
    robot.send("signaling.exchange_ice_candidate", candidate)
    assert user.expect("signaling.exchange_ice_candidate") == candidate

    robot.status(2)
    assert user.expect("status.update")["status"] == 2
    user.send("signaling.close_peer_connection", {"rtcConnectionId": connection_id, "code": "peer.closed"})
    assert robot.expect("signaling.close_peer_connection") == {"rtcConnectionId": connection_id}


def test_c1_spellings_are_understood_both_ways(server: Any) -> None:
    person = server.account()
    robot_id, robot_token = server.robot(person)
    robot = server.connect_robot(robot_id, robot_token)
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    user.expect("status.update")
    connection_id = made(server, token, robot_id)
    robot.expect("signaling.prepare_connection")
    user.send("signaling.send_sdp_offer", {"rtcConnectionId": connection_id, "sdpOffer": "v=0"})
    robot.expect("signaling.send_sdp_offer")
    robot.send("signaling.send_ice_candidate", {"rtcConnectionId": connection_id, "iceCandidate": CANDIDATE})
    assert user.expect("signaling.exchange_ice_candidate")["iceCandidate"] == CANDIDATE
    user.send("signaling.close_connection", {"rtcConnectionId": connection_id})
    assert robot.expect("signaling.close_peer_connection") == {"rtcConnectionId": connection_id}


def test_the_bare_ping_of_old_dashboards_is_passed_over(server: Any) -> None:
    server.account()
    user = server.connect_operator(server.log_in())
    user.connection.send('{"type":"ping"}')
    user.expect_silence()


def test_a_robot_without_authorization_needs_no_token(server: Any) -> None:
    robot_id, _ = server.robot(server.account(), auth=RobotAuthType.NO_AUTHORIZATION)
    server.connect_robot(robot_id, None)


def test_refusals_have_the_original_codes_and_spellings(server: Any) -> None:
    robot_id, _ = server.robot(server.account())
    robot = server.open("/ws/robot")
    robot.expect("authorize.req")
    robot.send("authorize", {"robotId": str(uuid4()), "data": "x"})
    assert robot.expect("authorize") == 20001
    robot.send("authorize", {"robotId": robot_id, "data": "wrong"})
    assert robot.expect("authorize.res") == 10021
    robot.send("authorize", {"robotId": robot_id})
    assert robot.expect("authorize.res") == 10021
    robot.send("signaling.send_sdp_answer", {"rtcConnectionId": "x", "sdpAnswer": "y"})
    assert robot.expect("signaling.send_sdp_answer.res") == 10021
    robot.connection.send("{broken")
    assert robot.expect("unknown.res") == 10001

    user = server.open("/ws/user")
    user.expect("authorize.req")
    user.send("status.subscribe", {"robotIds": []})
    assert user.expect("status.subscribe") == 10021
    user.send("authorize", {"accessToken": "nonsense"})
    assert user.expect("authorize.res") == 2015
    user.send("authorize", {})
    assert user.expect("authorize.res") == 10021


@pytest.mark.parametrize("path", ["/ws/robot", "/ws/user"])
@pytest.mark.parametrize(
    "data", [5, -1, 1.5, True, "nonsense", [], [{}], {"robotId": 5, "accessToken": 5}, {"extensions": "all"}]
)
def test_a_log_in_of_nonsense_is_answered(server: Any, path: str, data: Any) -> None:
    party = server.open(path)
    party.expect("authorize.req")
    party.send("authorize", data)
    assert party.expect("authorize.res") == 10000


def talking(server: Any) -> tuple[Any, Any, str]:
    """A robot of ours and an original operator in the middle of a connection."""
    robot_id, robot_token = server.robot(server.account())
    robot = server.connect_robot(robot_id, robot_token, {"multiPeer": 1, "tickets": 1, "closeReasons": 1})
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass
    connection_id = made(server, token, robot_id)
    user.send("signaling.send_sdp_offer", {"rtcConnectionId": connection_id, "sdpOffer": "v=0"})
    robot.expect("signaling.prepare_connection")
    robot.expect("signaling.send_sdp_offer")
    robot.send("signaling.send_sdp_answer", {"rtcConnectionId": connection_id, "sdpAnswer": "v=0"})
    assert user.expect("signaling.send_sdp_answer").keys() == {"rtcConnectionId", "sdpAnswer"}
    return robot, user, connection_id


@pytest.mark.parametrize("code", [1000, 1001])
def test_an_original_page_that_is_closed_frees_the_robot_at_once(server: Any, code: int) -> None:
    robot, user, connection_id = talking(server)
    user.connection.close(code)
    told = robot.expect("signaling.close_peer_connection", timeout_s=1.0)
    assert told == {"rtcConnectionId": connection_id, "code": "peer.closed"}


def test_a_refused_second_offer_leaves_the_first_connection_to_the_operator(server: Any) -> None:
    robot, user, connection_id = talking(server)
    user.send("signaling.send_sdp_offer", {"rtcConnectionId": connection_id, "sdpOffer": "v=0 again"})
    robot.expect("signaling.send_sdp_offer")
    robot.send("signaling.close_peer_connection", {"rtcConnectionId": connection_id, "code": "signal.bad_message"})
    assert user.expect("signaling.send_sdp_offer") == 20007
    user.send("signaling.exchange_ice_candidate", {"rtcConnectionId": connection_id, "iceCandidate": CANDIDATE})
    assert robot.expect("signaling.exchange_ice_candidate")["rtcConnectionId"] == connection_id


def test_a_session_outlives_connections_that_its_robot_refuses(server: Any) -> None:
    robot_id, robot_token = server.robot(server.account())
    extensions = {"multiPeer": 1, "tickets": 1, "closeReasons": 1}
    robot = server.connect_robot(robot_id, robot_token, extensions)
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token, extensions)
    user.send("status.subscribe", {"robotIds": [robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass

    def offered(session_id: str | None) -> tuple[str, str]:
        body = {"robotIds": [robot_id]} | ({"sessionId": session_id} if session_id else {})
        (session,) = server.post(CONNECTION, token, body).json()["resultData"]["sessions"]
        user.send("signaling.send_sdp_offer", {"rtcConnectionId": session["rtcSessionId"], "sdpOffer": "v=0"})
        robot.expect("signaling.prepare_connection")
        robot.expect("signaling.send_sdp_offer")
        return session["rtcSessionId"], session["sessionId"]

    live, session_id = offered(None)
    for _ in range(3):
        refused, _ = offered(session_id)
        robot.send("signaling.close_peer_connection", {"rtcConnectionId": refused, "code": "signal.robot_busy"})
        assert user.expect("signaling.close_peer_connection")["rtcConnectionId"] == refused
    user.expect_silence(0.6)  # several checks of what no longer holds
    user.send("signaling.exchange_ice_candidate", {"rtcConnectionId": live, "iceCandidate": CANDIDATE})
    assert robot.expect("signaling.exchange_ice_candidate")["rtcConnectionId"] == live


def test_our_robot_gets_ticket_operator_and_ice_servers(server: Any) -> None:
    person = server.account()
    robot_id, robot_token = server.robot(person)
    extensions = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
    robot = server.connect_robot(robot_id, robot_token, extensions)
    robot.status(0)
    token = server.log_in()
    user = server.connect_operator(token, extensions)
    connection_id = made(server, token, robot_id)
    prepared = robot.expect("signaling.prepare_connection")
    assert prepared["rtcConnectionId"] == connection_id
    assert prepared["operator"] == {"id": person.id, "name": "Ada", "role": "supervisor", "program": False}
    assert prepared["ticket"].count(".") == 2
    assert prepared["iceServers"] == []
    user.send(
        "signaling.send_sdp_offer", {"rtcConnectionId": connection_id, "sdpOffer": "v=0", "tracks": {"0": "front"}}
    )
    assert robot.expect("signaling.send_sdp_offer")["tracks"] == {"0": "front"}
    robot.send(
        "signaling.close_peer_connection",
        {"rtcConnectionId": connection_id, "code": "peer.shutdown", "message": "bye"},
    )
    assert user.expect("signaling.close_peer_connection")["code"] == "peer.shutdown"
