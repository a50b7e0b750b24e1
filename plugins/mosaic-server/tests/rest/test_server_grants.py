"""Roles per account and robot over REST: who may grant what to whom, and what the robot is told."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from jwt.utils import base64url_decode
from sqlalchemy import select
from sqlalchemy.orm import Session

from mosaic_server.storage.accounts import Person
from mosaic_server.storage.audit import audit_page
from mosaic_server.storage.tables import RobotGrant

OURS = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
CONNECTION = "/api/v1/webrtc/connection"


class Lab:
    """An organization with an admin, a plain account, a program and a robot."""

    def __init__(self, server: Any) -> None:
        self.server = server
        self.ada: Person = server.account()
        self.bob: Person = server.member(self.ada, "bob@example.org")
        self.bot: Person = server.member(self.ada, "bot@example.org", is_program=True)
        self.robot_id, self.robot_token = server.robot(self.ada)
        self.admin = server.log_in()
        self.plain = server.log_in("bob@example.org")

    @property
    def grants(self) -> str:
        return f"/api/v1/robots/{self.robot_id}/grants"

    def grant(self, person: Person, role: str, token: str | None = None) -> Any:
        return self.server.put(f"{self.grants}/{person.id}", token or self.admin, {"role": role})

    def roles(self) -> dict[str, str]:
        page = self.server.get(self.grants, self.admin).json()["resultData"]
        assert page["count"] == len(page["data"])
        return {one["email"]: one["role"] for one in page["data"]}

    def connect_robot(self) -> Any:
        robot = self.server.open("/ws/robot")
        robot.expect("authorize.req")
        robot.send("authorize", {"robotId": self.robot_id, "data": self.robot_token, "extensions": OURS})
        robot.expect("authorize.res")
        self.key = robot.expect("session.welcome")["keys"][0]
        return robot

    def made(self, token: str, **more: Any) -> str:
        answer = self.server.post(CONNECTION, token, {"robotIds": [self.robot_id]} | more)
        assert answer.status_code == 200, answer.text
        return answer.json()["resultData"]["sessions"][0]["rtcSessionId"]

    def prepared(self, robot: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """The claims of the ticket that the robot just got, and what the message says of the operator."""
        message = robot.expect("signaling.prepare_connection")
        public = Ed25519PublicKey.from_public_bytes(base64url_decode(self.key["x"]))
        return jwt.decode(message["ticket"], public, algorithms=["EdDSA"]), message["operator"]


@pytest.fixture
def lab(server: Any) -> Lab:
    return Lab(server)


def refusal(answer: Any) -> tuple[int, str]:
    return answer.status_code, answer.json()["code"]


def test_everybody_has_a_role_before_anything_is_granted(lab: Lab) -> None:
    assert lab.roles() == {
        "ada@example.org": "supervisor",
        "bob@example.org": "operator",
        "bot@example.org": "operator",
    }


def test_a_grant_is_shown_counts_and_is_taken_back(lab: Lab) -> None:
    granted = lab.grant(lab.bob, "observer").json()["resultData"]
    assert granted == {
        "accountId": lab.bob.id,
        "email": "bob@example.org",
        "fullName": "bob",
        "isActive": True,
        "isProgram": False,
        "isOrganizationAdmin": False,
        "role": "observer",
        "isGranted": True,
    }
    assert lab.grant(lab.bob, "observer").status_code == 200, "granting it again is fine"
    robot = lab.server.get(f"/api/v1/robots/{lab.robot_id}", lab.plain).json()["resultData"]
    assert robot["myRole"] == "observer"
    listed = lab.server.get("/api/v1/robots", lab.plain).json()["resultData"]["data"]
    assert [one["myRole"] for one in listed] == ["observer"]
    for _ in range(2):
        back = lab.server.delete(f"{lab.grants}/{lab.bob.id}", lab.admin).json()["resultData"]
        assert (back["role"], back["isGranted"]) == ("operator", False)


def test_a_grant_is_for_one_robot_only(lab: Lab) -> None:
    other, _ = lab.server.robot(lab.ada, "other")
    lab.grant(lab.bob, "observer")
    assert lab.server.get(f"/api/v1/robots/{other}", lab.plain).json()["resultData"]["myRole"] == "operator"


def test_the_default_of_plain_accounts_may_be_changed_for_all(lab: Lab) -> None:
    lab.grant(lab.bot, "operator")
    changed = lab.server.put("/api/v1/organization", lab.admin, {"defaultRole": "observer"})
    assert changed.json()["resultData"]["defaultRole"] == "observer"
    assert lab.server.get("/api/v1/organization", lab.plain).json()["resultData"]["defaultRole"] == "observer"
    assert set(lab.roles().values()) == {"supervisor", "observer", "operator"}
    assert lab.roles()["bob@example.org"] == "observer"
    assert lab.server.put("/api/v1/organization", lab.plain, {"defaultRole": "supervisor"}).status_code == 403


def test_only_admins_of_the_same_organization_see_and_change_grants(lab: Lab) -> None:
    eve = lab.server.account("eve@example.org")
    stranger = lab.server.log_in("eve@example.org")
    assert refusal(lab.server.get(lab.grants, lab.plain)) == (403, "auth.forbidden")
    assert refusal(lab.grant(lab.bob, "supervisor", lab.plain)) == (403, "auth.forbidden")
    assert refusal(lab.server.delete(f"{lab.grants}/{lab.bob.id}", lab.plain)) == (403, "auth.forbidden")
    assert refusal(lab.server.get(lab.grants, stranger)) == (404, "auth.unknown_robot")
    assert refusal(lab.grant(eve, "supervisor", stranger)) == (404, "auth.unknown_robot")
    assert refusal(lab.grant(eve, "supervisor")) == (404, "auth.unknown_account"), "strangers can't be let in"
    assert "eve@example.org" not in lab.roles()


def test_unknown_robots_accounts_and_roles_are_refused_in_words(lab: Lab) -> None:
    missing = f"/api/v1/robots/{uuid4()}/grants/{lab.bob.id}"
    assert refusal(lab.server.put(missing, lab.admin, {"role": "observer"})) == (404, "auth.unknown_robot")
    for account in (str(uuid4()), "nonsense", "%ED%A0%80"):
        answer = lab.server.put(f"{lab.grants}/{account}", lab.admin, {"role": "observer"})
        assert refusal(answer) == (404, "auth.unknown_account")
    assert lab.grant(lab.bob, "god").status_code == 400
    assert lab.grant(lab.bob, "").status_code == 400


def test_nobody_raises_the_own_role_and_everybody_may_lower_it(lab: Lab) -> None:
    eve = lab.server.member(lab.ada, "eve@example.org", is_admin=True)
    token = lab.server.log_in("eve@example.org")
    assert lab.grant(eve, "observer", token).status_code == 200
    assert refusal(lab.grant(eve, "supervisor", token)) == (403, "auth.own_account")
    assert refusal(lab.server.delete(f"{lab.grants}/{eve.id}", token)) == (403, "auth.own_account")
    assert lab.roles()["eve@example.org"] == "observer"
    assert lab.grant(eve, "supervisor").status_code == 200, "another admin may"


def test_the_last_supervisor_stays(lab: Lab) -> None:
    assert refusal(lab.grant(lab.ada, "operator")) == (409, "auth.last_supervisor")
    lab.grant(lab.bot, "supervisor")
    assert refusal(lab.grant(lab.ada, "operator")) == (409, "auth.last_supervisor"), "a program is no person"
    lab.grant(lab.bob, "supervisor")
    assert lab.grant(lab.ada, "operator").status_code == 200
    users = f"/api/v1/users/{lab.bob.id}"
    for change in ({"isActive": False}, {"isProgram": True}):
        assert refusal(lab.server.put(users, lab.admin, change)) == (409, "auth.last_supervisor")
    assert refusal(lab.server.delete(users, lab.admin)) == (409, "auth.last_supervisor")
    assert refusal(lab.server.delete(f"{lab.grants}/{lab.bob.id}", lab.admin)) == (409, "auth.last_supervisor")
    assert lab.roles()["bob@example.org"] == "supervisor", "nothing of what was refused was done"
    assert lab.server.get("/api/v1/users/me", lab.plain).status_code == 200


def test_admins_add_list_change_and_remove_accounts(lab: Lab) -> None:
    new = {"email": "Cleo@example.org", "fullName": "Cleo", "isProgram": True}
    made = lab.server.post("/api/v1/users", lab.admin, new).json()["resultData"]
    login = {"username": "cleo@example.org", "password": made["password"]}
    assert lab.server.http.post("/api/v1/account/login/access-token", json=login).status_code == 200
    assert refusal(lab.server.post("/api/v1/users", lab.admin, new))[0] == 409
    page = lab.server.get("/api/v1/users?limit=2&skip=2", lab.admin).json()["resultData"]
    assert page["count"] == 4
    assert [one["email"] for one in page["data"]] == ["bot@example.org", "cleo@example.org"]
    assert [one["isProgram"] for one in page["data"]] == [True, True]
    changed = lab.server.put(f"/api/v1/users/{made['id']}", lab.admin, {"isProgram": False}).json()["resultData"]
    assert changed["isProgram"] is False
    assert lab.server.delete(f"/api/v1/users/{made['id']}", lab.admin).status_code == 200
    assert refusal(lab.server.delete(f"/api/v1/users/{made['id']}", lab.admin)) == (404, "auth.unknown_account")
    own = {"email": "dan@example.org", "password": "chosen by the admin"}
    assert lab.server.post("/api/v1/users", lab.admin, own).json()["resultData"]["password"] is None


def test_accounts_are_the_business_of_their_own_admins_only(lab: Lab) -> None:
    lab.server.account("eve@example.org")
    stranger = lab.server.log_in("eve@example.org")
    path = f"/api/v1/users/{lab.bob.id}"
    assert lab.server.get("/api/v1/users", stranger).json()["resultData"]["count"] == 1
    assert refusal(lab.server.put(path, stranger, {"isActive": False})) == (404, "auth.unknown_account")
    assert refusal(lab.server.delete(path, stranger)) == (404, "auth.unknown_account")
    for answer in (
        lab.server.get("/api/v1/users", lab.plain),
        lab.server.post("/api/v1/users", lab.plain, {"email": "x@example.org"}),
        lab.server.put(path, lab.plain, {"isOrganizationAdmin": True}),
        lab.server.delete(path, lab.plain),
        lab.server.get("/api/v1/audit", lab.plain),
    ):
        assert refusal(answer) == (403, "auth.forbidden")
    own = f"/api/v1/users/{lab.ada.id}"
    assert refusal(lab.server.put(own, lab.admin, {"isProgram": False})) == (403, "auth.own_account")
    assert refusal(lab.server.delete(own, lab.admin)) == (403, "auth.own_account")


def test_ticket_and_message_say_the_role_on_this_robot_and_who_is_a_program(lab: Lab) -> None:
    robot = lab.connect_robot()
    bot = lab.server.log_in("bot@example.org")
    for person, token, role, program in (
        (lab.ada, lab.admin, "supervisor", False),
        (lab.bob, lab.plain, "operator", False),
        (lab.bot, bot, "operator", True),
    ):
        lab.server.connect_operator(token)
        lab.made(token)
        claims, operator = lab.prepared(robot)
        assert (claims["sub"], claims["role"], claims["program"]) == (person.id, role, program)
        assert (operator["id"], operator["role"], operator["program"]) == (person.id, role, program)


def test_an_old_access_token_gets_tickets_of_the_new_role(lab: Lab) -> None:
    robot = lab.connect_robot()
    lab.server.connect_operator(lab.plain)
    lab.grant(lab.bob, "observer")
    lab.made(lab.plain)
    assert lab.prepared(robot)[0]["role"] == "observer", "an observer connects and watches"
    lab.server.put(f"/api/v1/users/{lab.bob.id}", lab.admin, {"isOrganizationAdmin": True})
    lab.server.delete(f"{lab.grants}/{lab.bob.id}", lab.admin)
    assert robot.expect("signaling.close_peer_connection")["code"] == "auth.role_changed"
    lab.made(lab.plain)
    assert lab.prepared(robot)[0]["role"] == "supervisor"


def test_an_observer_is_kept_from_a_robot_that_would_let_it_drive(lab: Lab) -> None:
    robot = lab.server.connect_robot(lab.robot_id, lab.robot_token)
    robot.status(0)
    user = lab.server.connect_operator(lab.plain)
    user.send("status.subscribe", {"robotIds": [lab.robot_id]})
    while user.expect("status.update")["status"] != 0:
        pass
    lab.grant(lab.bob, "observer")
    assert refusal(lab.server.post(CONNECTION, lab.plain, {"robotIds": [lab.robot_id]})) == (403, "auth.roles_unknown")
    actions = [one["action"] for one in lab.server.get("/api/v1/audit", lab.admin).json()["resultData"]["data"]]
    assert "connection.made" not in actions
    lab.grant(lab.bob, "operator")
    lab.made(lab.plain)


def test_deleting_a_robot_or_an_account_removes_its_grants(lab: Lab) -> None:
    other, _ = lab.server.robot(lab.ada, "other")
    for person, robot_id in ((lab.bob, lab.robot_id), (lab.bob, other), (lab.bot, lab.robot_id)):
        lab.server.put(f"/api/v1/robots/{robot_id}/grants/{person.id}", lab.admin, {"role": "observer"})
    lab.server.delete(f"/api/v1/robots/{other}", lab.admin)
    lab.server.delete(f"/api/v1/users/{lab.bob.id}", lab.admin)

    def left(session: Session) -> list[tuple[str, str]]:
        return [(grant.robot_id, grant.account_id) for grant in session.scalars(select(RobotGrant))]

    assert lab.server.work(left) == [(lab.robot_id, lab.bot.id)]


def test_the_audit_log_tells_who_did_what_and_only_to_the_own_admins(lab: Lab) -> None:
    robot = lab.connect_robot()
    lab.server.connect_operator(lab.plain)
    lab.grant(lab.bob, "observer")
    lab.made(lab.plain)
    lab.prepared(robot)
    lab.server.delete(f"{lab.grants}/{lab.bob.id}", lab.admin)
    for email, password in (("bob@example.org", "wrong"), ("my-password", "wrong")):
        lab.server.http.post("/api/v1/account/login/access-token", json={"username": email, "password": password})
    page = lab.server.get("/api/v1/audit", lab.admin).json()["resultData"]
    told = [(one["action"], one["actor"], one["account"], one["robot"], one["role"]) for one in page["data"]]
    assert told == [
        ("login.failed", "", "bob@example.org", "", ""),
        ("role.revoked", "ada@example.org", "bob@example.org", "rover", "operator"),
        ("connection.made", "bob@example.org", "bob@example.org", "rover", "observer"),
        ("role.granted", "ada@example.org", "bob@example.org", "rover", "observer"),
    ]
    assert page["data"][0]["address"] == "127.0.0.1"
    assert page["next"] is None
    assert "my-password" not in str(lab.server.work(audit_page, None, limit=100)), "it may be a password"
    lab.server.account("eve@example.org")
    stranger = lab.server.log_in("eve@example.org")
    assert lab.server.get("/api/v1/audit", stranger).json()["resultData"] == {"data": [], "next": None}


def test_the_audit_log_is_read_page_by_page(lab: Lab) -> None:
    for role in ("observer", "supervisor", "operator", "observer", "supervisor"):
        lab.grant(lab.bob, role)
    roles: list[str] = []
    path: str | None = "/api/v1/audit?limit=2&action=role.granted"
    while path is not None:
        page = lab.server.get(path, lab.admin).json()["resultData"]
        roles += [one["role"] for one in page["data"]]
        path = None if page["next"] is None else f"/api/v1/audit?limit=2&action=role.granted&before={page['next']}"
    assert roles == ["supervisor", "observer", "operator", "supervisor", "observer"]
    for method in ("PUT", "POST", "DELETE"):
        assert lab.server.http.request(method, "/api/v1/audit").status_code == 405


def test_openapi_describes_grants_accounts_organization_and_audit(server: Any) -> None:
    described = server.http.get("/openapi.json").json()
    for path, methods in {
        "/api/v1/robots/{robot_id}/grants": {"get"},
        "/api/v1/robots/{robot_id}/grants/{account_id}": {"put", "delete"},
        "/api/v1/users": {"get", "post"},
        "/api/v1/users/{account_id}": {"put", "delete"},
        "/api/v1/organization": {"get", "put"},
        "/api/v1/audit": {"get"},
    }.items():
        assert described["paths"][path].keys() == methods
    assert described["components"]["schemas"]["Role"]["enum"] == ["observer", "operator", "supervisor"]
