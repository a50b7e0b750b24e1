"""Requests that nobody sends by accident: refused in words, never a 500."""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus


def test_ids_and_numbers_that_no_database_takes_are_refused(server: Any) -> None:
    server.account()
    headers = {"Authorization": f"Bearer {server.log_in()}", "Content-Type": "application/json"}
    half_a_pair = b'"\\ud800"'
    for path, body, status in (
        ("/api/v1/webrtc/connection", b'{"robotIds":[%s]}' % half_a_pair, 404),
        ("/api/v1/robots/auth/simple-token", b'{"robotId":%s}' % half_a_pair, 404),
    ):
        answer = server.http.post(path, content=body, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (status, "auth.unknown_robot")
    assert server.http.get("/api/v1/robots?skip=" + "9" * 30, headers=headers).status_code == 400


def test_nonsense_about_accounts_roles_and_the_audit_log_is_refused(server: Any) -> None:
    person = server.account()
    robot_id, _ = server.robot(person)
    headers = {"Authorization": f"Bearer {server.log_in()}", "Content-Type": "application/json"}
    grant = f"/api/v1/robots/{robot_id}/grants/{person.id}"
    for method, path, body in (
        ("POST", "/api/v1/users", b'{"email":"\\ud800@example.org"}'),
        ("POST", "/api/v1/users", b'{"email":"x@example.org","fullName":"\\ud800"}'),
        ("POST", "/api/v1/users", b'{"email":"x@example.org","password":"\\ud800\\ud800\\ud800\\ud800"}'),
        ("POST", "/api/v1/users", b'{"email":"x@example.org\\u0000"}'),
        ("POST", "/api/v1/users", b'{"email":"x@example.org","fullName":"\\u001b[31m"}'),
        ("POST", "/api/v1/robots", b'{"name":"rover\\u0000"}'),
        ("PUT", f"/api/v1/robots/{robot_id}", b'{"description":"\\u0000"}'),
        ("POST", "/api/v1/account/login/access-token", b'{"username":"\\u0000","password":"long enough"}'),
        ("POST", "/api/v1/account/signup", b'{"email":"\\ud800@example.org","password":"long enough"}'),
        ("POST", "/api/v1/account/login/access-token", b'{"username":"\\ud800","password":"\\ud800"}'),
        ("PUT", "/api/v1/users/me", b'{"fullName":"\\ud800"}'),
        ("PUT", grant, b'{"role":"\\ud800"}'),
        ("PUT", grant, b'{"role":["observer"]}'),
        ("PUT", grant, b"[]"),
        ("PUT", "/api/v1/organization", b'{"defaultRole":null}'),
        ("GET", "/api/v1/audit?before=0", b""),
        ("GET", "/api/v1/audit?before=" + "9" * 30, b""),
        ("GET", "/api/v1/audit?action=bogus", b""),
        ("GET", f"/api/v1/robots/{robot_id}/grants?limit=0", b""),
    ):
        answer = server.http.request(method, path, content=body, headers=headers)
        assert answer.status_code in (400, 401), (path, body, answer.text)
        assert answer.json()["resultData"] is None


@pytest.mark.parametrize("path", ["/" + "a" * 400, "/a%00b", "/assets/" + "a" * 400 + ".js"])
def test_paths_that_no_file_can_have_are_no_mistake_of_the_server(server: Any, path: str) -> None:
    assert server.http.get(path).status_code in (200, 404, 503)  # 503: the dashboard isn't built


def test_an_origin_that_is_no_address_is_a_foreign_one(server: Any) -> None:
    with pytest.raises(InvalidStatus) as refused:
        server.open("/ws/user", origin="http://[")
    assert refused.value.response.status_code == 403


def test_of_two_who_sign_up_at_once_with_one_email_one_is_told_so(server: Any) -> None:
    body = {"email": "grace@example.org", "password": "long enough"}
    with ThreadPoolExecutor(4) as people:
        answers = people.map(lambda _: server.http.post("/api/v1/account/signup", json=body).status_code, range(4))
        assert sorted(answers) == [200, 409, 409, 409]


def test_a_line_break_in_a_path_forges_no_line_of_the_log(server: Any, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "mosaic_server.access")
    server.http.get("/api/x%0aforged")
    server.http.get("/healthz")  # the line is written after the answer is sent
    logged = [record.getMessage() for record in caplog.records if record.name == "mosaic_server.access"]
    assert any(line.startswith("GET /api/x%0Aforged 404") for line in logged)
