"""Guessing of passwords and sign-in codes is slowed down, and only for those who guess."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import pytest

from mosaic_server.security.login_limits import PER_ADDRESS, PER_EMAIL_AND_ADDRESS
from mosaic_server.settings import Settings

PASSWORD = "correct horse battery"  # noqa: S105 - of throw-away accounts


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """The guessers speak through a proxy, for addresses of their own."""
    return replace(settings, trusted_proxies=("127.0.0.1",))


def test_guesses_side_by_side_count_like_guesses_one_after_another(server: Any) -> None:
    server.account()
    body = {"username": "ada@example.org", "password": "wrong"}
    with ThreadPoolExecutor(3 * PER_EMAIL_AND_ADDRESS.failures) as guessers:
        answers = guessers.map(
            lambda _: server.http.post("/api/v1/account/login/access-token", json=body).status_code,
            range(3 * PER_EMAIL_AND_ADDRESS.failures),
        )
        wrong = list(answers).count(401)
    assert (
        PER_EMAIL_AND_ADDRESS.failures <= wrong <= PER_EMAIL_AND_ADDRESS.failures + 1
    )  # two passwords are checked at once


def test_a_stolen_log_in_is_no_way_to_guess_the_password(server: Any) -> None:
    server.account()
    headers = {"Authorization": f"Bearer {server.log_in()}"}
    body = {"currentPassword": "wrong", "newPassword": "something else"}
    answers = [
        server.http.put("/api/v1/users/me/password", json=body, headers=headers).status_code
        for _ in range(PER_EMAIL_AND_ADDRESS.failures + 1)
    ]
    assert answers == [400] * PER_EMAIL_AND_ADDRESS.failures + [429]


@pytest.mark.parametrize(
    "wrong", [{"password": "wrong"}, {"organizationName": "wrong"}], ids=["password", "organization"]
)
def test_the_log_in_of_an_organization_is_no_second_set_of_guesses(server: Any, wrong: dict[str, str]) -> None:
    server.account()
    right = {"username": "ada@example.org", "password": PASSWORD}
    path, named = "/api/v1/account/login/organization/access-token", right | {"organizationName": "ada@example.org"}
    assert server.http.post(path, json=named).status_code == 200
    answers = [server.http.post(path, json=named | wrong).status_code for _ in range(PER_EMAIL_AND_ADDRESS.failures)]
    assert answers == [401] * PER_EMAIL_AND_ADDRESS.failures
    assert server.http.post(path, json=named).status_code == 429
    assert server.http.post("/api/v1/account/login/access-token", json=right).status_code == 429


def test_wrong_sign_in_codes_lock_out_their_sender_and_nobody_else(server: Any) -> None:
    server.account()
    code = server.post("/api/v1/account/one-time-code", server.log_in()).json()["resultData"]["code"]

    def sign_in(code: str, address: str) -> int:
        headers = {"X-Forwarded-For": address}
        return int(server.http.post("/api/v1/account/login/one-time", json={"code": code}, headers=headers).status_code)

    answers = [sign_in("wrong", "192.0.2.1") for _ in range(PER_ADDRESS.failures + 1)]
    assert answers == [401] * PER_ADDRESS.failures + [429]
    assert sign_in(code, "192.0.2.2") == 200


def test_a_stranger_can_not_lock_the_owner_out(server: Any) -> None:
    server.account()

    def log_in(password: str, address: str) -> int:
        body, headers = {"username": "ada@example.org", "password": password}, {"X-Forwarded-For": address}
        return int(server.http.post("/api/v1/account/login/access-token", json=body, headers=headers).status_code)

    guesses = [log_in("wrong", f"2001:db8::{number:x}") for number in range(1, PER_EMAIL_AND_ADDRESS.failures + 2)]
    assert guesses == [401] * PER_EMAIL_AND_ADDRESS.failures + [429]
    assert log_in(PASSWORD, "2001:db8::9") == 429, "the right one is no better guess from there"
    assert log_in(PASSWORD, "192.0.2.2") == 200


def test_a_new_password_ends_the_sign_in_codes_that_were_issued_before(server: Any) -> None:
    server.account()
    token = server.log_in()
    code = server.post("/api/v1/account/one-time-code", token).json()["resultData"]["code"]
    body = {"currentPassword": PASSWORD, "newPassword": "something else"}
    changed = server.http.put("/api/v1/users/me/password", json=body, headers={"Authorization": f"Bearer {token}"})
    assert changed.status_code == 200
    assert server.http.post("/api/v1/account/login/one-time", json={"code": code}).status_code == 401
