"""Roles of accounts on robots: reading what is effective, and changing what was granted.

Nothing here changes a role without an entry in the audit log, and no change leaves a robot without a supervisor.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Row, Select, and_, func, select, true, update
from sqlalchemy.orm import Session

from mosaic_server.roles import Role, Standing, loses_last_supervisor
from mosaic_server.storage.audit import COMMAND_LINE, AuditAction, AuditEntry, note
from mosaic_server.storage.tables import Account, IssuedTicket, Organization, RobotGrant, RobotRow, now_ms


class UnknownAccount(Exception):
    """The robot's organization has no such account."""


class LastSupervisor(Exception):
    """The change would leave a robot without anybody who supervises it."""


class LastAdministrator(Exception):
    """The change would leave an organization's accounts without an administrator."""


class OwnAccount(Exception):
    """The account is the asker's own, and nobody may raise the own role."""


@dataclass(frozen=True, slots=True)
class Actor:
    """The account that changes something. ``account_id=None``: the command line, which answers to nobody but the file's
    owner."""

    name: str
    account_id: str | None = None


BY_COMMAND = Actor(COMMAND_LINE)
"""Who does what the commands of ``mosaic`` do, in the audit log."""


@dataclass(frozen=True, slots=True)
class RoleOnRobot:
    """The role of one account on one robot."""

    account_id: str
    email: str
    full_name: str
    robot_id: str
    standing: Standing


def role_on(session: Session, account_id: str, robot_id: str) -> RoleOnRobot | None:
    """``None`` if there is no such account or robot. The pair may be of two organizations: ask the standing."""
    row = session.execute(_pairs().where(Account.id == account_id, RobotRow.id == robot_id)).one_or_none()
    return None if row is None else _role_on_robot(row)


def roles_of_account(session: Session, account_id: str, robot_ids: Collection[str]) -> dict[str, Role]:
    """The account's roles on those of the robots that it may use."""
    rows = session.execute(_pairs().where(Account.id == account_id, RobotRow.id.in_(robot_ids)))
    roles = {one.robot_id: one.standing.role for one in map(_role_on_robot, rows)}
    return {robot_id: role for robot_id, role in roles.items() if role is not None}


def operates_anything(session: Session, account_id: str) -> bool:
    """Whether the account may operate a robot of its organization, or could if there were one."""
    account = session.get_one(Account, account_id)
    rows = session.execute(
        _pairs().where(Account.id == account_id, Account.organization_id == RobotRow.organization_id)
    )
    roles = [_role_on_robot(row).standing.role_if_active for row in rows]
    if not roles:
        default_role = Role(session.get_one(Organization, account.organization_id).default_role)
        roles = [Role.SUPERVISOR if account.is_organization_admin else default_role]
    return any(role is not Role.OBSERVER for role in roles)


def roles_of_tickets(session: Session) -> dict[tuple[str, str], RoleOnRobot]:
    """(account, robot) → role, for every pair that has a ticket and still exists."""
    rows = session.execute(_pairs(of_tickets=True).distinct())
    return {(one.account_id, one.robot_id): one for one in map(_role_on_robot, rows)}


def roles_on_robot(session: Session, robot_id: str, skip: int, limit: int) -> tuple[list[RoleOnRobot], int]:
    """One page of the accounts of the robot's organization by e-mail with their roles, and how many there are."""
    mine = (RobotRow.id == robot_id, Account.organization_id == RobotRow.organization_id)
    page = _pairs().where(*mine).order_by(Account.email).offset(skip).limit(limit)
    count = session.scalar(select(func.count()).select_from(Account).join(RobotRow, true()).where(*mine)) or 0
    return [_role_on_robot(row) for row in session.execute(page)], count


def set_role(session: Session, robot_id: str, account_id: str, role: Role | None, actor: Actor) -> RoleOnRobot:
    """Grant the role, or with ``None`` take the grant back so that the default counts again.

    Raises :class:`UnknownAccount`, :class:`OwnAccount`, :class:`LastSupervisor`. Granting what is granted already is
    no change.
    """
    robot = session.get_one(RobotRow, robot_id)
    with supervised(session, robot.organization_id, robot_id):
        before = role_on(session, account_id, robot_id)
        if before is None or not before.standing.is_same_organization:
            raise UnknownAccount
        if before.standing.granted is role:
            return before
        _write(session, robot_id, account_id, role)
        after = role_on(session, account_id, robot_id)
        assert after is not None
        if account_id == actor.account_id and _rank(after) > _rank(before):
            raise OwnAccount
        note(session, _entry(robot, before, after, actor))
    return after


@contextmanager
def supervised(session: Session, organization_id: str, robot_id: str | None = None) -> Iterator[None]:
    """Raises (and so rolls back) if something inside the block takes away the last who could repair it.

    :class:`LastSupervisor` for a robot, :class:`LastAdministrator` for the organization.
    """
    # Taking this lock first makes two administrators who demote each other at once wait for one another.
    session.execute(update(Organization).where(Organization.id == organization_id).values(updated_at_ms=now_ms()))
    which = (RobotRow.organization_id == organization_id, *([RobotRow.id == robot_id] if robot_id else []))
    before, had_administrator = _standings(session, which), _is_administered(session, organization_id)
    yield
    session.flush()
    after = _standings(session, which)
    for one, standings in before.items():
        if loses_last_supervisor(standings, after.get(one, ())):
            raise LastSupervisor(session.get_one(RobotRow, one).name)
    if had_administrator and not _is_administered(session, organization_id):
        raise LastAdministrator


def _is_administered(session: Session, organization_id: str) -> bool:
    """Nobody needs to administer an organization without accounts."""
    mine = select(Account.id).where(Account.organization_id == organization_id).limit(1)
    administrators = mine.where(Account.is_organization_admin, Account.is_active)
    return session.scalar(administrators) is not None or session.scalar(mine) is None


def _standings(session: Session, which: Collection[ColumnElement[bool]]) -> dict[str, list[Standing]]:
    found: dict[str, list[Standing]] = {}
    for row in session.execute(_pairs().where(*which, Account.organization_id == RobotRow.organization_id)):
        one = _role_on_robot(row)
        found.setdefault(one.robot_id, []).append(one.standing)
    return found


def _write(session: Session, robot_id: str, account_id: str, role: Role | None) -> None:
    mine = (RobotGrant.robot_id == robot_id, RobotGrant.account_id == account_id)
    grant = session.scalar(select(RobotGrant).where(*mine))
    if role is None:
        session.delete(grant)
    elif grant is None:
        session.add(RobotGrant(robot_id=robot_id, account_id=account_id, role=role))
    else:
        grant.role = role
    session.flush()


def _rank(one: RoleOnRobot) -> int:
    return one.standing.role_if_active.rank


def _entry(robot: RobotRow, before: RoleOnRobot, after: RoleOnRobot, actor: Actor) -> AuditEntry:
    return AuditEntry(
        AuditAction.ROLE_REVOKED if after.standing.granted is None else AuditAction.ROLE_GRANTED,
        robot.organization_id,
        actor=actor.name,
        account_id=after.account_id,
        account=after.email,
        robot_id=robot.id,
        robot=robot.name,
        role=after.standing.role_if_active,
        detail=f"was {before.standing.role_if_active}",
    )


def _pairs(*, of_tickets: bool = False) -> Select[*tuple[Any, ...]]:
    """Accounts × robots with what decides the role; the caller narrows it down, unless only pairs of tickets count."""
    grant_of_pair = and_(RobotGrant.account_id == Account.id, RobotGrant.robot_id == RobotRow.id)
    ticket_of_pair = and_(IssuedTicket.account_id == Account.id, IssuedTicket.robot_id == RobotRow.id)
    pairs = (
        select(
            Account.id,
            Account.email,
            Account.full_name,
            Account.is_active,
            Account.is_program,
            Account.is_organization_admin,
            (Account.organization_id == RobotRow.organization_id).label("is_same_organization"),
            Organization.default_role,
            RobotRow.id.label("robot_id"),
            RobotGrant.role.label("granted"),
        )
        .select_from(Account)
        .join(Organization, Organization.id == Account.organization_id)
        .join(RobotRow, true())
    )
    if of_tickets:
        pairs = pairs.join(IssuedTicket, ticket_of_pair)
    return pairs.outerjoin(RobotGrant, grant_of_pair)


def _role_on_robot(row: Row[Any]) -> RoleOnRobot:
    standing = Standing(
        is_active=row.is_active,
        is_program=row.is_program,
        is_organization_admin=row.is_organization_admin,
        is_same_organization=bool(row.is_same_organization),
        default_role=Role(row.default_role),
        granted=None if row.granted is None else Role(row.granted),
    )
    return RoleOnRobot(row.id, row.email, row.full_name, row.robot_id, standing)
