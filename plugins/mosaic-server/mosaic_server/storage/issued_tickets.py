"""Which tickets were issued, and which of them no longer hold.

A robot can't be asked what it was told, and peers outlive sockets and servers: so it is written down here until the
robot has heard that the connection is over.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from mosaic_server.storage.audit import AuditAction, AuditEntry, note
from mosaic_server.storage.grants import RoleOnRobot, role_on, roles_of_tickets
from mosaic_server.storage.robots import robots_by_id
from mosaic_server.storage.tables import IssuedTicket, now_ms

PER_ACCOUNT_AND_ROBOT = 64
"""Beyond this many the oldest connections are closed, so that a page that never says good-bye can't fill the table."""
PER_SESSION = 2
"""A session's newest connection, and the one that it replaces."""
LIFETIME_MS = 30 * 24 * 3600 * 1000
"""No connection lives longer than thirty days."""


class NoAccess(Exception):
    """The account is disabled or gone, or the robot belongs to another organization."""


@dataclass(frozen=True, slots=True)
class WantedTicket:
    """A connection that is to be made."""

    robot_id: str
    connection_id: str
    session_id: str


@dataclass(frozen=True, slots=True)
class VoidTicket:
    """A ticket that no longer counts. ``code``: why its connection has to be closed. ``is_newest`` of all tickets for
    this robot.
    """

    robot_id: str
    connection_id: str
    code: str
    is_newest: bool


def record_tickets(
    session: Session, account_id: str, wanted: Sequence[WantedTicket], address: str
) -> list[RoleOnRobot]:
    """The roles to write on tickets, recorded in the same transaction; raises :class:`NoAccess`, then nothing is.

    Superseding comes first because a write is what makes SQLite wait for whoever is changing a role at this moment.
    On PostgreSQL such a change may slip in between; the next check finds the ticket void.
    """
    for one in wanted:
        _supersede(session, account_id, one)
    roles = [_recorded(session, account_id, one) for one in wanted]
    robots = robots_by_id(session, [one.robot_id for one in wanted])
    for role in roles:
        robot = robots[role.robot_id]
        note(
            session,
            AuditEntry(
                AuditAction.CONNECTION_MADE,
                robot.organization_id,
                actor=role.email,
                account_id=role.account_id,
                account=role.email,
                robot_id=robot.id,
                robot=robot.name,
                role=role.standing.role_if_active,
                address=address,
                detail="program" if role.standing.is_program else "",
            ),
        )
    return roles


def void_tickets(session: Session, robot_id: str | None = None) -> list[VoidTicket]:
    """Those whose role, kind or access is another today, and those that are over; of one robot or of all."""
    which = select(IssuedTicket).order_by(IssuedTicket.created_at_ms)
    if robot_id is not None:
        which = which.where(IssuedTicket.robot_id == robot_id)
    tickets = list(session.scalars(which))
    newest = {ticket.robot_id: ticket.id for ticket in tickets}
    roles = roles_of_tickets(session) if tickets else {}
    found = [(ticket, _void_because(ticket, roles.get((ticket.account_id, ticket.robot_id)))) for ticket in tickets]
    return [
        VoidTicket(ticket.robot_id, ticket.id, code, newest[ticket.robot_id] == ticket.id)
        for ticket, code in found
        if code is not None
    ]


def forget_tickets(session: Session, connection_ids: Collection[str]) -> None:
    """Their robots have heard that these are over."""
    session.execute(delete(IssuedTicket).where(IssuedTicket.id.in_(connection_ids)))


def _void_because(ticket: IssuedTicket, today: RoleOnRobot | None) -> str | None:
    if ticket.is_over:
        return "peer.replaced"
    if ticket.created_at_ms < now_ms() - LIFETIME_MS:
        return "auth.expired"
    if today is None or today.standing.role != ticket.role or today.standing.is_program != ticket.is_program:
        return "auth.role_changed"
    return None


def _supersede(session: Session, account_id: str, wanted: WantedTicket) -> None:
    mine = (IssuedTicket.account_id == account_id, IssuedTicket.robot_id == wanted.robot_id)
    newest = select(IssuedTicket.id).order_by(IssuedTicket.created_at_ms.desc(), IssuedTicket.id)
    of_session = newest.where(*mine, IssuedTicket.session_id == wanted.session_id).limit(PER_SESSION - 1)
    of_account = newest.where(*mine).limit(PER_ACCOUNT_AND_ROBOT - 1)
    over = update(IssuedTicket).where(*mine).values(is_over=True)
    session.execute(over.where(IssuedTicket.id.not_in(of_account)))
    session.execute(
        over.where(IssuedTicket.session_id == wanted.session_id, IssuedTicket.id.not_in(of_session)),
    )


def _recorded(session: Session, account_id: str, wanted: WantedTicket) -> RoleOnRobot:
    found = role_on(session, account_id, wanted.robot_id)
    if found is None or found.standing.role is None:
        raise NoAccess
    session.add(
        IssuedTicket(
            id=wanted.connection_id,
            robot_id=wanted.robot_id,
            account_id=account_id,
            session_id=wanted.session_id,
            role=found.standing.role,
            is_program=found.standing.is_program,
        )
    )
    session.flush()
    return found
