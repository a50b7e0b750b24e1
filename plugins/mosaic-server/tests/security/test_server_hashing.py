"""Log-ins wait in a line of their own at the real server: nobody else waits, and who hangs up costs nothing."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import pytest
from support.waiting import wait_for

from mosaic_server.rest import password_attempts
from mosaic_server.security import hashing_line
from mosaic_server.settings import Settings

LOG_IN = "/api/v1/account/login/access-token"


class SlowHashing:
    """Every check of a password takes until the test says so."""

    def __init__(self) -> None:
        self.began = 0
        self.threads: set[str] = set()
        self.may_end = threading.Event()
        self._changed = threading.Condition()

    def check(self, _stored: str | None, _password: str) -> None:
        with self._changed:
            self.began += 1
            self.threads.add(threading.current_thread().name)
            self._changed.notify_all()
        self.may_end.wait(20)

    def wait_for(self, began: int) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: self.began >= began, 20)


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowHashing]:
    slow = SlowHashing()
    monkeypatch.setattr(password_attempts, "check_password", slow.check)
    yield slow
    slow.may_end.set()


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Strangers speak through a proxy, for addresses of their own."""
    return replace(settings, trusted_proxies=("127.0.0.1",))


@contextlib.contextmanager
def log_in(server: Any, address: str = "192.0.2.1") -> Iterator[socket.socket]:
    """One that has been sent and is not answered yet."""
    body = json.dumps({"username": "nobody@example.org", "password": "wrong"})
    head = (
        f"POST {LOG_IN} HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Forwarded-For: {address}\r\nContent-Type: application/json\r\n"
    )
    with socket.create_connection(("127.0.0.1", server.listening.port), timeout=20) as connection:
        connection.sendall(f"{head}Content-Length: {len(body)}\r\n\r\n{body}".encode())
        yield connection


def waiting(server: Any) -> int:
    return sum(map(len, server.server.services.hashing._waiting.values()))


def test_thirty_log_ins_at_once_delay_nobody_else(server: Any, slow: SlowHashing) -> None:
    """Neither health nor what reads the database; and another address is the next whose password is checked."""
    server.account()
    with contextlib.ExitStack() as stack:
        for _ in range(30):
            stack.enter_context(log_in(server))
        slow.wait_for(1)
        wait_for(lambda: waiting(server) == 29, "29 log-ins wait")
        stack.enter_context(log_in(server, "192.0.2.2"))
        slow.wait_for(2)
        assert server.http.get("/healthz").status_code == 200
        assert server.http.post("/api/v1/account/login/one-time", json={"code": "wrong"}).status_code == 401
        assert slow.began == 2
        assert all(name.startswith("mosaic-hashing") for name in slow.threads)


def test_whoever_hangs_up_while_waiting_is_not_hashed(server: Any, slow: SlowHashing) -> None:
    with log_in(server):
        slow.wait_for(1)
        with contextlib.ExitStack() as stack:
            for _ in range(5):
                stack.enter_context(log_in(server))
            wait_for(lambda: waiting(server) == 5, "five log-ins wait")
        wait_for(lambda: waiting(server) == 0, "nobody waits any more")
        slow.may_end.set()
    assert slow.began == 1


def test_whoever_hangs_up_while_being_hashed_has_guessed(server: Any, slow: SlowHashing) -> None:
    limits = server.server.services.login_limits
    with log_in(server):
        slow.wait_for(1)
    slow.may_end.set()
    wait_for(lambda: any("nobody@example.org" in key for key in limits._failures), "the failure is counted")


@pytest.mark.parametrize(("bound", "status"), [("MOST_WAITING", 429), ("MOST_IN_LINE", 503)])
def test_a_full_line_refuses_at_once_and_says_when_to_come_again(
    server: Any, slow: SlowHashing, monkeypatch: pytest.MonkeyPatch, bound: str, status: int
) -> None:
    monkeypatch.setattr(hashing_line, bound, 1)
    with log_in(server), contextlib.ExitStack() as stack:
        slow.wait_for(1)
        stack.enter_context(log_in(server))
        wait_for(lambda: waiting(server) == 1, "one log-in waits")
        body = {"username": "nobody@example.org", "password": "wrong"}
        answer = server.http.post(LOG_IN, json=body, headers={"X-Forwarded-For": "192.0.2.1"})
        assert answer.status_code == status
        assert int(answer.headers["Retry-After"]) >= 1
        assert ("from this address" in answer.json()["message"]) is (status == 429)


def test_sign_ups_and_new_passwords_wait_in_the_same_line(server: Any) -> None:
    """A hundred of them end, though two at a time are hashed, and each person can log in."""
    server.account()
    token = server.log_in()
    people = [f"person{number}@example.org" for number in range(20)]

    def add(email: str) -> int:
        body = {"email": email, "password": "correct horse battery", "fullName": ""}
        return int(server.post("/api/v1/users", token, body).status_code)

    with ThreadPoolExecutor(10) as admins:
        assert set(admins.map(add, people)) == {200}
    assert [server.log_in(email) != "" for email in people] == [True] * 20
