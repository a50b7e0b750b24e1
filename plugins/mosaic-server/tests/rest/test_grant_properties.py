"""A random walk over accounts, robots, grants and tickets, beside a model that computes every role by itself."""

from __future__ import annotations

import contextlib
from functools import cache
from uuid import uuid4

import jwt
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.orm import Session

from mosaic_core.words.signaling import OperatorIdentity
from mosaic_server.roles import Role
from mosaic_server.security.tickets import TicketOffice
from mosaic_server.storage.grants import (
    Actor,
    LastAdministrator,
    LastSupervisor,
    OwnAccount,
    UnknownAccount,
    roles_of_account,
    set_role,
)
from mosaic_server.storage.issued_tickets import NoAccess, WantedTicket, record_tickets, void_tickets
from mosaic_server.storage.members import MemberChange, change_member, remove_member, set_default_role, shut_out
from mosaic_server.storage.robots import add_robot, remove_robot
from mosaic_server.storage.tables import Account, Base, Organization

pick = st.integers(0, 1_000_000)
roles = st.sampled_from(Role)
COMMAND = Actor("test")
KEY = Ed25519PrivateKey.generate()


class Member:
    """The model's account."""

    def __init__(self, organization: str, is_admin: bool, is_program: bool) -> None:
        self.organization, self.is_admin, self.is_program, self.is_active = organization, is_admin, is_program, True


@cache
def engine() -> Engine:
    """One for all walks: it remembers the statements that it compiled."""
    made = create_engine("sqlite://")
    event.listen(made, "connect", lambda connection, _: connection.execute("PRAGMA foreign_keys=ON"))
    Base.metadata.create_all(made)
    return made


def emptied_engine() -> Engine:
    with engine().begin() as connection:
        for table in reversed(Base.metadata.sorted_tables):
            connection.execute(table.delete())
    return engine()


class Organizations(RuleBasedStateMachine):
    """Two organizations; every change is tried in the database and, if it was done, in the model."""

    def __init__(self) -> None:
        super().__init__()
        self.session = Session(emptied_engine(), expire_on_commit=False)
        self.office = TicketOffice(KEY)
        self.members: dict[str, Member] = {}
        self.robots: dict[str, str] = {}
        self.grants: dict[tuple[str, str], Role] = {}
        self.defaults: dict[str, Role] = {}
        self.tickets: dict[str, tuple[str, str, Role, bool]] = {}
        for name in ("lab", "school"):
            organization = Organization(name=name)
            self.session.add(organization)
            self.session.flush()
            self.defaults[organization.id] = Role.OPERATOR
        self.session.commit()
        for which in (0, 1):
            self.somebody_joins(which, is_admin=True, is_program=False)
            self.somebody_joins(which, is_admin=False, is_program=False)
            self.a_robot_comes(which)

    def teardown(self) -> None:
        self.session.close()

    # --- what may happen

    @precondition(lambda self: len(self.members) < 12)
    @rule(which=pick, is_admin=st.booleans(), is_program=st.booleans())
    def somebody_joins(self, which: int, is_admin: bool, is_program: bool) -> None:
        organization = list(self.defaults)[which % 2]
        account = Account(
            organization_id=organization,
            email=f"{uuid4()}@example.org",
            password_hash="x",  # noqa: S106 - nobody logs in
            is_organization_admin=is_admin,
            is_program=is_program,
        )
        self.session.add(account)
        self.session.commit()
        self.members[account.id] = Member(organization, is_admin, is_program)

    @precondition(lambda self: len(self.robots) < 6)
    @rule(which=pick)
    def a_robot_comes(self, which: int) -> None:
        organization = list(self.defaults)[which % 2]
        self.robots[add_robot(self.session, organization, "rover").id] = organization
        self.session.commit()

    @precondition(lambda self: len(self.robots) > 1)
    @rule(which=pick)
    def a_robot_goes(self, which: int) -> None:
        robot_id = self._robot(which)
        remove_robot(self.session, robot_id)
        self.session.commit()
        del self.robots[robot_id]
        self.grants = {pair: role for pair, role in self.grants.items() if pair[0] != robot_id}
        self.tickets = {one: ticket for one, ticket in self.tickets.items() if ticket[0] != robot_id}

    @rule(robot=pick, account=pick, role=st.none() | roles)
    def a_role_is_granted(self, robot: int, account: int, role: Role | None) -> None:
        self._grant(self._robot(robot), self._member(account), COMMAND, role)

    @rule(robot=pick, account=pick, role=st.none() | roles)
    def somebody_changes_the_own_role(self, robot: int, account: int, role: Role | None) -> None:
        account_id = self._member(account)
        self._grant(self._robot(robot), account_id, Actor("admin", account_id), role)

    def _grant(self, robot_id: str, account_id: str, who: Actor, role: Role | None) -> None:
        before = self._role(account_id, robot_id)
        with self._tried(UnknownAccount, OwnAccount):
            changed = set_role(self.session, robot_id, account_id, role, who)
            self.session.commit()
            assert self.members[account_id].organization == self.robots[robot_id], "a stranger was let in"
            self.grants.pop((robot_id, account_id), None)
            if role is not None:
                self.grants[robot_id, account_id] = role
            now = self._role(account_id, robot_id)
            assert changed.standing.role == now
            if account_id == who.account_id and before is not None and now is not None:
                assert now.rank <= before.rank, "somebody raised the own role"

    @rule(account=pick, active=st.none() | st.booleans(), admin=st.none() | st.booleans())
    def an_account_changes(self, account: int, active: bool | None, admin: bool | None) -> None:
        account_id = self._member(account)
        with self._tried():
            change_member(self.session, account_id, MemberChange(active, None, admin), COMMAND)
            self.session.commit()
            member = self.members[account_id]
            member.is_admin = member.is_admin if admin is None else admin
            member.is_active = member.is_active if active is None else active

    @rule(account=pick)
    def an_account_becomes_a_programs_or_a_persons(self, account: int) -> None:
        account_id = self._member(account)
        is_program = not self.members[account_id].is_program
        with self._tried():
            change_member(self.session, account_id, MemberChange(is_program=is_program), COMMAND)
            self.session.commit()
            self.members[account_id].is_program = is_program

    @rule(account=pick, is_active=st.booleans())
    def the_servers_administrator_shuts_out(self, account: int, is_active: bool) -> None:
        account_id = self._member(account)
        shut_out(self.session, account_id, is_active, COMMAND)
        self.session.commit()
        self.members[account_id].is_active = is_active

    @precondition(lambda self: len(self.members) > 2)
    @rule(account=pick)
    def somebody_leaves(self, account: int) -> None:
        account_id = self._member(account)
        with self._tried():
            remove_member(self.session, account_id, COMMAND)
            self.session.commit()
            organization = self.members.pop(account_id).organization
            self.grants = {pair: role for pair, role in self.grants.items() if pair[1] != account_id}
            if organization not in {one.organization for one in self.members.values()} | set(self.robots.values()):
                self._founded_again(organization)

    @rule(which=pick, role=roles)
    def the_default_changes(self, which: int, role: Role) -> None:
        organization = list(self.defaults)[which % 2]
        with self._tried():
            set_default_role(self.session, organization, role, COMMAND)
            self.session.commit()
            self.defaults[organization] = role

    @rule(account=pick, robot=pick)
    def a_ticket_is_issued(self, account: int, robot: int) -> None:
        account_id, robot_id = self._member(account), self._robot(robot)
        wanted = WantedTicket(robot_id, str(uuid4()), str(uuid4()))
        role, is_program = self._role(account_id, robot_id), self.members[account_id].is_program
        try:
            (found,) = record_tickets(self.session, account_id, [wanted], "192.0.2.1")
        except NoAccess:
            self.session.rollback()
            assert role is None
            return
        self.session.commit()
        assert role is not None, "somebody without access got a ticket"
        operator = OperatorIdentity(
            id=account_id, name="", role=found.standing.role_if_active, program=found.standing.is_program
        )
        ticket = self.office.issue(session_id="s", robot_id=robot_id, peer_id=wanted.connection_id, operator=operator)
        claims = jwt.decode(ticket, KEY.public_key(), algorithms=["EdDSA"])
        assert (claims["role"], claims["program"]) == (role, is_program)
        self.tickets[wanted.connection_id] = (robot_id, account_id, role, is_program)

    # --- what must hold

    @invariant()
    def the_database_knows_the_same_roles_and_no_others(self) -> None:
        for account_id in self.members:
            expected = {one: role for one in self.robots if (role := self._role(account_id, one)) is not None}
            assert roles_of_account(self.session, account_id, list(self.robots)) == expected
        self.session.rollback()

    @invariant()
    def exactly_the_tickets_that_say_something_else_are_void(self) -> None:
        void = {one.connection_id for one in void_tickets(self.session)}
        self.session.rollback()
        assert void == {
            one
            for one, (robot_id, account_id, role, is_program) in self.tickets.items()
            if account_id not in self.members
            or self._role(account_id, robot_id) != role
            or self.members[account_id].is_program != is_program
        }

    # --- the model

    def _role(self, account_id: str, robot_id: str) -> Role | None:
        member, organization = self.members[account_id], self.robots[robot_id]
        if not member.is_active or member.organization != organization:
            return None
        by_default = Role.SUPERVISOR if member.is_admin else self.defaults[organization]
        return self.grants.get((robot_id, account_id), by_default)

    def _supervised(self) -> set[str]:
        return {
            robot_id
            for robot_id in self.robots
            for account_id, member in self.members.items()
            if self._role(account_id, robot_id) is Role.SUPERVISOR and not member.is_program
        }

    def _administered(self) -> set[str]:
        plain = {one.organization for one in self.members.values()}
        admins = {one.organization for one in self.members.values() if one.is_admin and one.is_active}
        return admins | (self.defaults.keys() - plain)

    @contextlib.contextmanager
    def _tried(self, *refusals: type[Exception]) -> contextlib.AbstractContextManager[None]:  # type: ignore[misc]
        before, administered = self._supervised(), self._administered()
        try:
            yield
        except (LastAdministrator, LastSupervisor, *refusals):
            self.session.rollback()
        else:
            assert before <= self._supervised(), "a robot lost its last supervisor"
            assert administered <= self._administered(), "an organization lost its last administrator"

    def _founded_again(self, organization: str) -> None:
        """An empty organization goes with its last account."""
        self.session.add(Organization(id=organization, name=str(uuid4())))
        self.session.commit()
        self.defaults[organization] = Role.OPERATOR

    def _robot(self, which: int) -> str:
        return list(self.robots)[which % len(self.robots)]

    def _member(self, which: int) -> str:
        return list(self.members)[which % len(self.members)]


Organizations.TestCase.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
TestOrganizations = Organizations.TestCase
