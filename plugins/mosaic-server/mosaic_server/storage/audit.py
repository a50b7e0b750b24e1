"""The audit log: who granted, connected, failed to log in. Entries are added and, when old, dropped; never changed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from sqlalchemy import CursorResult, Delete, delete, select
from sqlalchemy.orm import Session

from mosaic_server.storage.tables import AuditEntryRow, now_ms

COMMAND_LINE = "command line"
"""The actor of `mosaic server …`: whoever may write the database file."""
_DAY_MS = 24 * 3600 * 1000


class AuditAction(StrEnum):
    """Actions that an audit entry tells of."""

    ROLE_GRANTED = "role.granted"
    ROLE_REVOKED = "role.revoked"
    DEFAULT_ROLE_CHANGED = "default-role.changed"
    ACCOUNT_ADDED = "account.added"
    ACCOUNT_CHANGED = "account.changed"
    ACCOUNT_REMOVED = "account.removed"
    CONNECTION_MADE = "connection.made"
    LOGIN_FAILED = "login.failed"


MOST_KEPT = {AuditAction.LOGIN_FAILED: 20_000, AuditAction.CONNECTION_MADE: 500_000}
"""Of these the oldest go first when there are more: strangers and busy pages must not fill the disk. What
administrators do is bounded by age alone, so that nobody can wash a grant away with noise."""


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """An entry of the audit log, as it is written. ``actor``: the e-mail of who did it, or :data:`COMMAND_LINE`;
    ``account`` and ``robot``: what it was done to.
    """

    action: AuditAction
    organization_id: str | None
    actor: str = ""
    account_id: str | None = None
    account: str = ""
    robot_id: str | None = None
    robot: str = ""
    role: str = ""
    address: str = ""
    detail: str = ""
    id: int = 0
    at_ms: int = 0


def note(session: Session, entry: AuditEntry) -> None:
    """Add an entry in the caller's transaction: what was done and that it was done are kept together."""
    session.add(
        AuditEntryRow(
            action=entry.action,
            organization_id=entry.organization_id,
            actor=entry.actor,
            account_id=entry.account_id,
            account=entry.account,
            robot_id=entry.robot_id,
            robot=entry.robot,
            role=entry.role,
            address=entry.address[:64],
            detail=entry.detail[:200],
        )
    )


def audit_page(
    session: Session,
    organization_id: str | None,
    *,
    limit: int,
    before: int | None = None,
    action: AuditAction | None = None,
) -> list[AuditEntry]:
    """The newest entries first, those with ids below ``before``. ``organization_id=None``: of all organizations."""
    page = select(AuditEntryRow).order_by(AuditEntryRow.id.desc()).limit(limit)
    if organization_id is not None:
        page = page.where(AuditEntryRow.organization_id == organization_id)
    if before is not None:
        page = page.where(AuditEntryRow.id < before)
    if action is not None:
        page = page.where(AuditEntryRow.action == action)
    return [_entry(row) for row in session.scalars(page)]


def prune_audit(session: Session, keep_days: float) -> int:
    """Drop what is older, and what is too many; returns how many entries went."""
    old = delete(AuditEntryRow).where(AuditEntryRow.at_ms < now_ms() - int(keep_days * _DAY_MS))
    dropped = _count(session, old)
    for action, most in MOST_KEPT.items():
        mine = AuditEntryRow.action == action
        oldest_kept = session.scalar(
            select(AuditEntryRow.id).where(mine).order_by(AuditEntryRow.id.desc()).offset(most - 1).limit(1)
        )
        if oldest_kept is not None:
            dropped += _count(session, delete(AuditEntryRow).where(mine, AuditEntryRow.id < oldest_kept))
    return dropped


def _entry(row: AuditEntryRow) -> AuditEntry:
    return AuditEntry(
        action=AuditAction(row.action),
        organization_id=row.organization_id,
        actor=row.actor,
        account_id=row.account_id,
        account=row.account,
        robot_id=row.robot_id,
        robot=row.robot,
        role=row.role,
        address=row.address,
        detail=row.detail,
        id=row.id,
        at_ms=row.at_ms,
    )


def _count(session: Session, statement: Delete) -> int:
    result = session.execute(statement)
    assert isinstance(result, CursorResult)
    return result.rowcount
