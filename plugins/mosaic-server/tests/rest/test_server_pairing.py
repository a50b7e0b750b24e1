"""Pairing over REST: who has the PIN or the code gets a sign-in that lasts until it is revoked; nobody else does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from uuid import UUID

import jwt
import pytest
from sqlalchemy import delete
from sqlalchemy.orm import Session

from mosaic_core.machines.lan.pairing_proof import claims_of, is_proved
from mosaic_server.roles import Role
from mosaic_server.security.login_limits import LoginLimits
from mosaic_server.security.pairing import LIFETIME_S, WRONG_PINS_PER_OFFER, PairingSecrets, PinLimits
from mosaic_server.settings import Settings
from mosaic_server.storage import devices
from mosaic_server.storage.audit import audit_page
from mosaic_server.storage.database import Database
from mosaic_server.storage.devices import adopt_robot, offer_state, open_offer, revoke_device
from mosaic_server.storage.grants import Actor
from mosaic_server.storage.tables import Account, AuditEntryRow, PairingOffer

ROBOT = str(UUID(int=7))
TOKEN = "mrt_of_the_robot"  # noqa: S105 - of a test
BY_TEST = Actor("test")


@pytest.fixture(scope="module")
def lan_server(tmp_path_factory: pytest.TempPathFactory, start_server: Callable[..., Any]) -> Iterator[Any]:
    """The server of one robot, the same for all tests: starting one takes longer than a test."""
    settings = lan_settings(tmp_path_factory.mktemp("lan"))
    with start_server(settings) as running:
        yield running


@pytest.fixture
def lan(lan_server: Any) -> Any:
    """With no device, no offer, and nothing counted."""
    lan_server.work(_emptied)
    lan_server.server.services.login_limits = LoginLimits()
    lan_server.server.services.pin_limits = PinLimits()
    return lan_server


def lan_settings(data_dir: Path) -> Settings:
    database = Database(data_dir)
    database.migrate()
    database.work(adopt_robot, ROBOT, "Rover", TOKEN)
    database.close()
    hosts = frozenset({"rover.local", "localhost"})
    return Settings(data_dir=data_dir, pairs_with="Rover", allowed_hosts=hosts, revocation_check_s=0.2)


def _emptied(session: Session) -> None:
    for table in (Account, PairingOffer, AuditEntryRow):
        session.execute(delete(table))
    adopt_robot(session, ROBOT, "Rover", TOKEN)


def offered(lan: Any, role: Role | None = None) -> PairingSecrets:
    _, shown = lan.work(open_offer, role)
    return shown


def pair(lan: Any, name: str = "phone", **secret: str) -> Any:
    return lan.http.post("/api/v1/pairing", json={**secret, "name": name})


def wrong(pin: str) -> str:
    return f"{(int(pin) + 1) % 10**8:08d}"


def test_the_first_device_supervises_and_the_next_operates(lan: Any) -> None:
    roles = [pair(lan, pin=offered(lan).pin).json()["resultData"]["role"] for _ in range(2)]
    assert roles == ["supervisor", "operator"]
    names = [(one.name, one.role, one.connected_at_ms) for one in lan.work(devices.devices)]
    assert names == [("phone", Role.SUPERVISOR, None), ("phone", Role.OPERATOR, None)]


@pytest.mark.parametrize("role", list(Role))
def test_an_offer_may_say_the_role(lan: Any, role: Role) -> None:
    assert pair(lan, code=offered(lan, role).code).json()["resultData"]["role"] == role


def test_the_sign_in_sees_the_robot_with_its_role_and_does_not_expire(lan: Any) -> None:
    token = pair(lan, "Ann's phone", code=offered(lan).code).json()["resultData"]["accessToken"]
    [robot] = lan.get("/api/v1/robots", token).json()["resultData"]["data"]
    assert (robot["id"], robot["name"], robot["myRole"]) == (ROBOT, "Rover", "supervisor")
    assert lan.get("/api/v1/users/me", token).json()["resultData"]["fullName"] == "Ann's phone"
    assert lan.get("/api/v1/users", token).status_code == 403, "it administers nothing"
    claims = jwt.decode(token, options={"verify_signature": False})
    assert claims["exp"] > 250_000_000_000


def test_a_clock_that_was_set_back_signs_nobody_out(lan: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    token = pair(lan, code=offered(lan).code).json()["resultData"]["accessToken"]
    monkeypatch.setattr("mosaic_server.security.access_tokens.time.time", lambda: 1_000_000.0)
    assert lan.get("/api/v1/users/me", token).status_code == 200


def test_a_pin_may_be_typed_as_it_is_shown_and_works_once(lan: Any) -> None:
    pin = offered(lan).pin
    assert pair(lan, pin=f"{pin[:4]} {pin[4:]}").status_code == 200
    again = pair(lan, pin=pin)
    assert (again.status_code, again.json()["code"]) == (401, "auth.pairing")
    assert "mosaic lan pair" in again.json()["cure"]


def test_a_pin_that_is_a_number_is_told_to_be_text(lan: Any) -> None:
    answer = lan.http.post("/api/v1/pairing", json={"pin": 12345, "name": "phone"}).json()
    assert 'write it as text, in quotes: "012345"' in str(answer)


def test_pin_and_code_of_one_offer_pair_one_device(lan: Any) -> None:
    shown = offered(lan)
    assert pair(lan, code=shown.code).status_code == 200
    assert pair(lan, pin=shown.pin).status_code == 401


def test_wrong_pins_make_the_pin_void_and_leave_the_code(lan: Any) -> None:
    offer_id, shown = lan.work(open_offer)
    for _ in range(WRONG_PINS_PER_OFFER):
        assert pair(lan, pin=wrong(shown.pin)).status_code == 401
    assert lan.work(offer_state, offer_id).is_open
    assert not lan.work(offer_state, offer_id).has_pin
    assert pair(lan, pin=shown.pin).status_code == 401
    assert pair(lan, code=shown.code).status_code == 200


def test_beyond_all_limits_no_pin_counts_and_the_code_does(lan: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LoginLimits, "failed", lambda *_: None)  # as from many addresses
    shown = offered(lan)
    answers = [pair(lan, pin=wrong(shown.pin)).status_code for _ in range(22)]
    assert answers == [401] * 20 + [429] * 2
    late = pair(lan, pin=offered(lan).pin)
    assert (late.status_code, late.json()["code"]) == (429, "auth.pairing_locked")
    assert int(late.headers["Retry-After"]) > 3000
    assert pair(lan, code=shown.code).status_code == 200


def test_one_address_that_fails_too_often_has_to_wait(lan: Any) -> None:
    answers = [pair(lan, code="nonsense").status_code for _ in range(31)]
    assert answers[:30] == [401] * 30
    assert answers[30] == 429


def test_an_offer_ends_after_five_minutes(lan: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shown, now_ms = offered(lan), devices.now_ms
    monkeypatch.setattr(devices, "now_ms", lambda: now_ms() + int(LIFETIME_S * 1000) + 1)
    assert pair(lan, pin=shown.pin).status_code == 401
    assert pair(lan, code=shown.code).status_code == 401


def test_many_offers_push_out_the_oldest(lan: Any) -> None:
    first = offered(lan)
    for _ in range(devices.MOST_OPEN):
        offered(lan)
    assert pair(lan, code=first.code).status_code == 401


@pytest.mark.parametrize("body", [{}, {"pin": "1", "code": "x"}, {"pin": ""}, {"code": "\0"}, {"code": "x" * 65}])
def test_either_a_pin_or_a_code_and_nothing_odd(lan: Any, body: dict[str, str]) -> None:
    assert lan.http.post("/api/v1/pairing", json=body).status_code == 400


def test_a_revoked_device_is_signed_out_and_its_socket_closed(lan: Any) -> None:
    token = pair(lan, code=offered(lan).code).json()["resultData"]["accessToken"]
    socket = lan.connect_operator(token)
    [device] = lan.work(devices.devices)
    lan.work(revoke_device, device.id, BY_TEST)
    assert socket.close_code() == 4401
    assert lan.get("/api/v1/users/me", token).status_code == 401
    assert lan.work(devices.devices) == []


def test_paired_devices_outlive_the_server(tmp_path: Path, start_server: Callable[..., Any]) -> None:
    whole = lan_settings(tmp_path)
    with start_server(whole) as first:
        token = pair(first, code=offered(first).code).json()["resultData"]["accessToken"]
    with start_server(whole) as second:
        assert second.get("/api/v1/robots", token).json()["resultData"]["data"][0]["myRole"] == "supervisor"


def test_a_server_of_many_robots_pairs_nothing(server: Any) -> None:
    assert server.http.post("/api/v1/pairing", json={"pin": "12345678"}).status_code == 404
    assert server.http.get("/api/v1/server").json()["resultData"]["pairsWith"] is None


def test_it_says_whose_server_it_is(lan: Any) -> None:
    assert lan.http.get("/api/v1/server").json()["resultData"]["pairsWith"] == "Rover"


@pytest.mark.parametrize(
    ("host", "status"),
    [("192.168.1.20:9002", 200), ("[fd00::1]:9002", 200), ("rover.local", 200), ("evil.example", 421), ("", 421)],
)
def test_addresses_and_own_names_are_answered_and_strangers_names_are_not(lan: Any, host: str, status: int) -> None:
    assert lan.http.get("/healthz", headers={"Host": host}).status_code == status


def test_a_robot_under_a_new_id_keeps_its_devices_and_their_roles(lan: Any) -> None:
    for role in (None, Role.OBSERVER):
        pair(lan, code=offered(lan, role).code)
    new = str(UUID(int=8))
    lan.work(adopt_robot, new, "Rover 2", "mrt_other")
    assert [one.role for one in lan.work(devices.devices)] == [Role.SUPERVISOR, Role.OBSERVER]
    lan.work(adopt_robot, new, "Rover 2", "mrt_other")
    assert [one.role for one in lan.work(devices.devices)] == [Role.SUPERVISOR, Role.OBSERVER]


def test_pairing_says_with_which_robot(lan: Any) -> None:
    data = pair(lan, pin=offered(lan).pin).json()["resultData"]
    assert (data["robotId"], data["robotName"]) == (ROBOT, "Rover")


def test_a_wrong_pin_is_told_with_the_tries_left(lan: Any) -> None:
    shown = offered(lan)
    told = [pair(lan, pin=wrong(shown.pin)).json()["message"] for _ in range(WRONG_PINS_PER_OFFER)]
    assert [message.split("; ")[1][0] for message in told] == ["4", "3", "2", "1", "0"]
    assert "more" not in pair(lan, code="nonsense").json()["message"]


def test_only_the_server_that_gave_a_sign_in_can_prove_it(lan: Any, server: Any) -> None:
    token = pair(lan, code=offered(lan).code).json()["resultData"]["accessToken"]
    question = {"claims": claims_of(token), "nonce": "n" * 32}
    proof = lan.http.post("/api/v1/pairing/proof", json=question).json()["resultData"]["proof"]
    assert is_proved(token, "n" * 32, proof)
    assert not is_proved(token, "m" * 32, proof)
    other = server.http.post("/api/v1/pairing/proof", json=question).json()["resultData"]["proof"]
    assert not is_proved(token, "n" * 32, other)
    assert token.rpartition(".")[2] not in proof


@pytest.mark.parametrize("question", [{}, {"claims": "a.b.c", "nonce": "n" * 32}, {"claims": "a.b", "nonce": "short"}])
def test_a_proof_is_made_of_claims_and_a_nonce_alone(lan: Any, question: dict[str, str]) -> None:
    assert lan.http.post("/api/v1/pairing/proof", json=question).status_code == 400


def test_a_device_unpairs_itself_and_nobody_else_can(lan: Any, server: Any) -> None:
    token = pair(lan, code=offered(lan).code).json()["resultData"]["accessToken"]
    stays = pair(lan, code=offered(lan).code).json()["resultData"]["accessToken"]
    socket = lan.connect_operator(token)
    headers = {"Authorization": f"Bearer {token}"}
    assert lan.http.delete("/api/v1/pairing").status_code == 401
    assert lan.http.delete("/api/v1/pairing", headers=headers).status_code == 200
    assert socket.close_code() == 4401
    assert lan.get("/api/v1/users/me", token).status_code == 401
    assert lan.get("/api/v1/users/me", stays).status_code == 200
    server.account()
    signed_in = {"Authorization": f"Bearer {server.log_in()}"}
    assert server.http.delete("/api/v1/pairing", headers=signed_in).status_code == 403


def test_pairing_and_revoking_stand_in_the_audit_log(lan: Any) -> None:
    pair(lan, "Ann's phone", code=offered(lan).code)
    pair(lan, pin="00000000")
    [device] = lan.work(devices.devices)
    lan.work(revoke_device, device.id, BY_TEST)
    told = [entry.detail for entry in lan.work(audit_page, None, limit=10)]
    assert told[0] == 'revoked device "Ann\'s phone"'
    assert "wrong PIN" in told
    assert 'paired device "Ann\'s phone"' in told
