"""What a program is told that asks the REST interface for something that it can't have."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_server.rest.missed_route import missed_route

LOG_IN = "/api/v1/account/login/access-token"


@pytest.mark.parametrize("method", ["GET", "POST", "DELETE"])
def test_an_unknown_path_is_404_and_names_itself_and_the_nearest_one(server: Any, method: str) -> None:
    answer = server.http.request(method, "/api/v1/account/login/access-tokn")
    told = answer.json()
    assert (answer.status_code, told["resultCode"], told["code"]) == (404, "INVALID_FORMAT", "rest.unknown_path")
    assert told["message"] == f"there is nothing at /api/v1/account/login/access-tokn; did you mean {LOG_IN}?"
    assert "/openapi.json" in told["cure"]


def test_a_path_that_resembles_nothing_gets_no_guess(server: Any) -> None:
    assert server.http.get("/api/zzz").json()["message"] == "there is nothing at /api/zzz"


@pytest.mark.parametrize("path", ["/robots", "/v1/robots", "/api/robots", "/api/v1/Robots/", "/api/v1/robot"])
def test_the_version_a_slash_or_a_letter_may_be_what_is_wrong(path: str) -> None:
    paths: dict[str, Any] = {"/api/v1/robots": {"get": {}}, LOG_IN: {"post": {}}}
    assert missed_route(paths, "GET", path).message.endswith("did you mean /api/v1/robots?")


def test_a_wrong_method_is_405_and_names_the_right_ones(server: Any) -> None:
    for method, path, right in (("GET", LOG_IN, "POST"), ("PUT", "/api/v1/robots", "GET or POST")):
        answer = server.http.request(method, path)
        told = answer.json()
        assert (answer.status_code, told["code"]) == (405, "rest.wrong_method")
        assert told["message"] == f"{path} takes {right}, not {method}"
        assert answer.headers["allow"] == right.replace(" or ", ", ")


def test_a_missing_or_wrong_field_is_named(server: Any) -> None:
    for body, field in (
        ({"username": "ada@example.org"}, "body.password"),
        ({"username": 1, "password": "x"}, "body.username"),
    ):
        answer = server.http.post(LOG_IN, json=body)
        told = answer.json()
        assert (answer.status_code, told["resultCode"], told["code"]) == (400, "INVALID_FORMAT", "rest.bad_request")
        assert told["message"].startswith(f"{field}: ")
        assert "Update" not in told["cure"]


def test_a_connection_without_a_socket_says_which_socket_to_open(server: Any) -> None:
    robot_id, _ = server.robot(server.account())
    answer = server.post("/api/v1/webrtc/connection", server.log_in(), {"robotIds": [robot_id]})
    told = answer.json()
    assert (told["resultCode"], told["code"]) == ("USER_WS_SESSION_NOT_EXIST", "signal.no_user_socket")
    assert told["cure"].startswith("Open /ws/user and authorize first")


def test_no_answer_of_rest_sends_people_to_update_something(server: Any) -> None:
    token, http = server.log_in(server.account().email), server.http
    answers = [
        http.get("/api/v1/nothing"),
        http.put(LOG_IN),
        http.post(LOG_IN, content=b"{", headers={"Content-Type": "application/json"}),
        server.post("/api/v1/robots", token, {}),
    ]
    for answer in answers:
        assert "Update the older" not in answer.json()["cure"], answer.text
