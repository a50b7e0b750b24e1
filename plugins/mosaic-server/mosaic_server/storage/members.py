"""Changing an organization: its accounts and the default role. Every change is in the audit log."""

from __future__ import annotations

from dataclasses import dataclass, field

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from mosaic_server.roles import Role
from mosaic_server.security.passwords import HashedPassword
from mosaic_server.storage.accounts import Membership, Person, add_account, change_password, person_by_id
from mosaic_server.storage.audit import AuditAction, AuditEntry, note
from mosaic_server.storage.grants import Actor, supervised
from mosaic_server.storage.tables import Account, Organization, RobotRow


@dataclass(frozen=True, slots=True)
class OrganizationRecord:
    """An organization as the rest of the server sees it."""

    id: str
    name: str
    default_role: Role


@dataclass(frozen=True, slots=True)
class MemberChange:
    """Changes to a member. What isn't given stays."""

    is_active: bool | None = None
    is_program: bool | None = None
    is_organization_admin: bool | None = None
    full_name: str | None = None
    password: str | HashedPassword | None = field(default=None, repr=False)

    def __str__(self) -> str:
        """For the audit log: neither name nor password."""
        words = (("active", self.is_active), ("program", self.is_program), ("admin", self.is_organization_admin))
        said = [f"{word}: {'yes' if value else 'no'}" for word, value in words if value is not None]
        said += ["new name"] if self.full_name is not None else []
        said += ["new password"] if self.password is not None else []
        return ", ".join(said)


def organization_of(session: Session, organization_id: str) -> OrganizationRecord:
    row = session.get_one(Organization, organization_id)
    return OrganizationRecord(row.id, row.name, Role(row.default_role))


def set_default_role(session: Session, organization_id: str, role: Role, actor: Actor) -> None:
    """The role of plain accounts where nothing was granted; raises :class:`LastSupervisor`."""
    with supervised(session, organization_id):
        organization = session.get_one(Organization, organization_id)
        before, organization.default_role = organization.default_role, role
        if before != role:
            detail = f"was {before}"
            entry = AuditEntry(AuditAction.DEFAULT_ROLE_CHANGED, organization_id, actor.name, role=role, detail=detail)
            note(session, entry)


def add_member(
    session: Session,
    email: str,
    password: str | HashedPassword,
    full_name: str,
    membership: Membership | None,
    is_program: bool,
    actor: Actor,
) -> Person:
    """A new account with its entry in the log; raises :class:`AccountExists`."""
    person = add_account(session, email, password, full_name, membership=membership, is_program=is_program)
    detail = str(MemberChange(is_program=is_program, is_organization_admin=person.is_organization_admin))
    _note(session, AuditAction.ACCOUNT_ADDED, person, actor, detail)
    return person


def change_member(session: Session, account_id: str, change: MemberChange, actor: Actor) -> Person:
    """Raises :class:`LastSupervisor`. A disabled account's log-ins end, and so do those of an account with a new
    password; a changed kind counts for new connections."""
    account = session.get_one(Account, account_id)
    if change.full_name is not None:
        account.full_name = change.full_name
    if change.password is not None:
        change_password(session, account_id, change.password)
    with supervised(session, account.organization_id):
        if change.is_active is not None and change.is_active != account.is_active:
            account.is_active = change.is_active
            account.login_version += 1
        if change.is_program is not None:
            account.is_program = change.is_program
        if change.is_organization_admin is not None:
            account.is_organization_admin = change.is_organization_admin
    person = person_by_id(session, account_id)
    assert person is not None
    _note(session, AuditAction.ACCOUNT_CHANGED, person, actor, str(change))
    return person


def shut_out(session: Session, account_id: str, is_active: bool, actor: Actor) -> None:
    """The server's administrator disables or enables any account, even the last supervisor's."""
    account = session.get_one(Account, account_id)
    account.is_active = is_active
    account.login_version += 1
    person = person_by_id(session, account_id)
    assert person is not None
    _note(session, AuditAction.ACCOUNT_CHANGED, person, actor, str(MemberChange(is_active=is_active)))


def remove_member(session: Session, account_id: str, actor: Actor) -> None:
    """The account and its grants; raises :class:`LastSupervisor`."""
    account = session.get_one(Account, account_id)
    person = person_by_id(session, account_id)
    assert person is not None
    with supervised(session, account.organization_id):
        session.delete(account)
    _drop_if_empty(session, person.organization_id)
    _note(session, AuditAction.ACCOUNT_REMOVED, person, actor)


def _drop_if_empty(session: Session, organization_id: str) -> None:
    """An organization without accounts and robots would only keep its name from being used again."""
    for table in (Account, RobotRow):
        if session.scalar(select(table.id).where(table.organization_id == organization_id).limit(1)) is not None:
            return
    session.execute(delete(Organization).where(Organization.id == organization_id))


def _note(session: Session, action: AuditAction, person: Person, actor: Actor, detail: str = "") -> None:
    entry = AuditEntry(
        action,
        person.organization_id,
        actor=actor.name,
        account_id=person.id,
        account=person.email,
        detail=detail,
    )
    note(session, entry)
