"""Which tickets hold: what an account was given, what superseded it, and what has changed since."""

from __future__ import annotations

from collections.abc import Iterator
from uuid import uuid4

import pytest
from sqlalchemy import create_engine, select
from sqlalchemy.orm import Session

from mosaic_server.roles import Role
from mosaic_server.storage import issued_tickets
from mosaic_server.storage.grants import Actor, set_role
from mosaic_server.storage.issued_tickets import (
    LIFETIME_MS,
    NoAccess,
    VoidTicket,
    WantedTicket,
    forget_tickets,
    record_tickets,
    void_tickets,
)
from mosaic_server.storage.members import MemberChange, change_member
from mosaic_server.storage.robots import add_robot
from mosaic_server.storage.tables import Account, AuditEntryRow, Base, IssuedTicket, Organization


class Database:
    """An organization with an administrator, Ann and two robots; the clock stands until the test moves it."""

    def __init__(self, session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
        self.session = session
        self.now_ms = 1_000_000
        organization = Organization(name="lab")
        session.add(organization)
        session.flush()
        self.organization_id = organization.id
        self.account("chief", is_organization_admin=True)
        self.ann = self.account("ann")
        self.rover, self.arm = (add_robot(session, organization.id, name).id for name in ("rover", "arm"))
        monkeypatch.setattr(issued_tickets, "now_ms", lambda: self.now_ms)

    def account(self, name: str, *, is_organization_admin: bool = False, **more: bool) -> str:
        one = Account(
            organization_id=self.organization_id,
            email=f"{name}@example.org",
            password_hash="x",  # noqa: S106 - nobody logs in
            is_organization_admin=is_organization_admin,
            **more,
        )
        self.session.add(one)
        self.session.flush()
        return one.id

    def give(self, connection_id: str, robot_id: str = "", session_id: str = "page", account_id: str = "") -> None:
        """A ticket, a second after the one before."""
        wanted = [WantedTicket(robot_id or self.rover, connection_id, session_id)]
        record_tickets(self.session, account_id or self.ann, wanted, "192.0.2.7")
        self.now_ms += 1000
        self.session.get_one(IssuedTicket, connection_id).created_at_ms = self.now_ms
        self.session.flush()

    def void(self, robot_id: str | None = None) -> list[tuple[str, str, bool]]:
        return [(one.connection_id, one.code, one.is_newest) for one in void_tickets(self.session, robot_id)]


@pytest.fixture
def database(monkeypatch: pytest.MonkeyPatch) -> Iterator[Database]:
    engine = create_engine("sqlite://")
    Base.metadata.create_all(engine)
    with Session(engine) as session:
        yield Database(session, monkeypatch)
    engine.dispose()


def test_a_ticket_is_written_down_with_the_role_it_was_given_for(database: Database) -> None:
    wanted = [WantedTicket(database.rover, "c1", "page"), WantedTicket(database.arm, "c2", "page")]
    roles = record_tickets(database.session, database.ann, wanted, "192.0.2.7")
    assert [(one.robot_id, one.email) for one in roles] == [
        (database.rover, "ann@example.org"),
        (database.arm, "ann@example.org"),
    ]
    ticket = database.session.get_one(IssuedTicket, "c1")
    assert (ticket.robot_id, ticket.account_id, ticket.session_id) == (database.rover, database.ann, "page")
    assert (ticket.role, ticket.is_program, ticket.is_over) == (Role.OPERATOR, False, False)
    assert database.void() == []


@pytest.mark.parametrize(("is_program", "detail"), [(False, ""), (True, "program")])
def test_the_audit_log_says_who_was_connected_to_what(database: Database, is_program: bool, detail: str) -> None:
    account_id = database.account("bot", is_program=is_program)
    database.give("c1", account_id=account_id)
    [entry] = database.session.scalars(select(AuditEntryRow).where(AuditEntryRow.robot_id == database.rover))
    assert (entry.action, entry.organization_id, entry.actor) == (
        "connection.made",
        database.organization_id,
        "bot@example.org",
    )
    assert (entry.account_id, entry.account, entry.robot) == (account_id, "bot@example.org", "rover")
    assert (entry.role, entry.address, entry.detail) == (Role.OPERATOR, "192.0.2.7", detail)


def test_who_has_no_access_gets_no_ticket_at_all(database: Database) -> None:
    database.session.get_one(Account, database.ann).is_active = False
    for account_id in (database.ann, str(uuid4())):
        with pytest.raises(NoAccess):
            database.give("c1", account_id=account_id)
    assert database.session.get(IssuedTicket, "c1") is None


def test_of_one_session_the_newest_two_connections_hold(database: Database) -> None:
    for connection_id in ("c1", "c2", "c3"):
        database.give(connection_id)
    database.give("c4", session_id="another page")
    database.give("c5", robot_id=database.arm)
    database.give("c6", account_id=database.account("ben"))
    assert database.void() == [("c1", "peer.replaced", False)]


def test_of_one_account_and_robot_so_many_hold(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(issued_tickets, "PER_ACCOUNT_AND_ROBOT", 3)
    database.give("of another robot", robot_id=database.arm)
    for number in range(4):
        database.give(f"c{number}", session_id=f"page {number}")
    assert database.void() == [("c0", "peer.replaced", False)]


def test_what_an_account_may_no_longer_do_its_tickets_may_neither(database: Database) -> None:
    database.give("c1")
    database.give("c2", account_id=database.account("ben"))
    set_role(database.session, database.rover, database.ann, Role.OBSERVER, Actor("test"))
    assert database.void() == [("c1", "auth.role_changed", False)]
    assert void_tickets(database.session) == [VoidTicket(database.rover, "c1", "auth.role_changed", False)]


def test_who_was_a_person_and_is_a_program_now_connects_anew(database: Database) -> None:
    database.give("c1")
    database.session.get_one(Account, database.ann).is_program = True
    assert database.void() == [("c1", "auth.role_changed", True)]


def test_who_is_gone_or_shut_out_keeps_no_connection(database: Database) -> None:
    ben = database.account("ben")
    database.give("c1")
    database.give("c2", account_id=ben)
    change_member(database.session, database.ann, MemberChange(is_active=False), Actor("test"))
    database.session.delete(database.session.get_one(Account, ben))
    database.session.flush()
    assert database.void() == [("c1", "auth.role_changed", False), ("c2", "auth.role_changed", True)]


def test_no_connection_lives_longer_than_thirty_days(database: Database) -> None:
    database.give("c1")
    database.now_ms += LIFETIME_MS
    assert database.void() == []
    database.now_ms += 1
    assert database.void() == [("c1", "auth.expired", True)]


def test_tickets_of_one_robot_are_asked_for_alone_oldest_first(database: Database) -> None:
    for number, robot_id in enumerate((database.rover, database.arm, database.rover)):
        database.give(f"c{number}", robot_id=robot_id, session_id=f"page {number}")
    database.session.get_one(Account, database.ann).is_program = True
    changed = "auth.role_changed"
    assert database.void(database.rover) == [("c0", changed, False), ("c2", changed, True)]
    assert database.void() == [("c0", changed, False), ("c1", changed, True), ("c2", changed, True)]


def test_what_robots_have_heard_is_forgotten(database: Database) -> None:
    database.give("c1")
    database.give("c2")
    forget_tickets(database.session, ["c1", "unknown"])
    assert list(database.session.scalars(select(IssuedTicket.id))) == ["c2"]
