"""Reading and writing accounts. Every function runs inside one transaction on a worker thread."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from mosaic_core.words.plain_text import plain
from mosaic_server.security.passwords import HashedPassword, hashed
from mosaic_server.storage.audit import AuditAction, AuditEntry, note
from mosaic_server.storage.organizations import add_organization
from mosaic_server.storage.tables import Account, Organization


class AccountExists(Exception):
    """The e-mail is taken."""


@dataclass(frozen=True, slots=True)
class Person:
    """An account as the rest of the server sees it."""

    id: str
    organization_id: str
    email: str
    full_name: str
    is_active: bool
    is_organization_admin: bool
    is_program: bool
    login_version: int
    created_at_ms: int
    updated_at_ms: int


def _person(account: Account) -> Person:
    return Person(
        id=account.id,
        organization_id=account.organization_id,
        email=account.email,
        full_name=account.full_name,
        is_active=account.is_active,
        is_organization_admin=account.is_organization_admin,
        is_program=account.is_program,
        login_version=account.login_version,
        created_at_ms=account.created_at_ms,
        updated_at_ms=account.updated_at_ms,
    )


def shown_name(session: Session, account_id: str) -> str:
    """What an account is called among its operators; with its own address where the name alone, or what it pretends to
    be, would be another's of the organization. Empty for an account that is gone."""
    own = session.get(Account, account_id)
    if own is None:
        return ""
    others = session.execute(
        select(Account.full_name, Account.email).where(
            Account.organization_id == own.organization_id, Account.id != own.id
        )
    )
    key = _looks(own.full_name)
    taken = any(key == _looks(other.full_name) or _looks(other.email) in key for other in others)
    return f"{own.full_name} ({own.email})" if own.full_name and taken else own.full_name or own.email


_TWINS = str.maketrans("аеорсухјѕԁһοανρτυк0іӏιıi1|", "aeopcyxjsdhoavptukolllllll", "\u115f\u1160\u2800")
"""Cyrillic and Greek letters, and signs, that look like small Latin ones; without the letters and signs that look like
a space."""


def _looks(name: str) -> str:
    """The same for names that people would take for one: without spaces, accents and marks that aren't seen, and with
    letters of other alphabets as the Latin ones that they look like."""
    folded = unicodedata.normalize("NFKD", plain(name)).casefold()
    return "".join(one for one in folded if unicodedata.category(one)[0] not in "CMZ").translate(_TWINS)


def normalised_email(email: str) -> str:
    return email.strip().lower()


def _find(session: Session, email: str) -> Account | None:
    return session.scalar(select(Account).where(Account.email == normalised_email(email)))


@dataclass(frozen=True, slots=True)
class Membership:
    """The organization of a new account, and its place there; without one it gets an organization of its own."""

    organization_id: str
    is_organization_admin: bool = False


def add_account(
    session: Session,
    email: str,
    password: str | HashedPassword,
    full_name: str = "",
    *,
    membership: Membership | None = None,
    is_program: bool = False,
) -> Person:
    """A new account, the admin of its own organization or a member of another; raises :class:`AccountExists`."""
    email = normalised_email(email)
    taken = select(Organization.id).where(Organization.name == email)
    if _find(session, email) is not None or (membership is None and session.scalar(taken) is not None):
        raise AccountExists(f"an account {email!r} exists already")
    account = Account(
        email=email,
        full_name=full_name,
        password_hash=hashed(password).text,  # before the first write, which keeps every other writer out
        is_program=is_program,
        is_organization_admin=membership is None or membership.is_organization_admin,
    )
    try:
        account.organization_id = membership.organization_id if membership else add_organization(session, email).id
        session.add(account)
        session.flush()
    except IntegrityError as error:  # somebody else was quicker
        raise AccountExists(f"an account {email!r} exists already") from error
    return _person(account)


def person_by_id(session: Session, account_id: str) -> Person | None:
    account = session.get(Account, account_id)
    return None if account is None else _person(account)


def person_by_email(session: Session, email: str) -> Person | None:
    account = _find(session, email)
    return None if account is None else _person(account)


@dataclass(frozen=True, slots=True)
class Claimed:
    """The account that somebody wants to log in to, and what its password has to match."""

    person: Person
    password: HashedPassword
    is_in_organization: bool
    """The organization that was named is its own, or none was."""


def claimed(session: Session, email: str, organization_name: str | None = None) -> Claimed | None:
    account = _find(session, email)
    if account is None:
        return None
    is_named = _is_named(session, account.organization_id, organization_name)
    return Claimed(_person(account), HashedPassword(account.password_hash), is_named)


def renew_hash(session: Session, before: Claimed, renewed: HashedPassword) -> None:
    """The same password, hashed at today's cost; not if it was changed meanwhile."""
    account = session.get(Account, before.person.id)
    if account is not None and account.password_hash == before.password.text:
        account.password_hash = renewed.text


def _is_named(session: Session, organization_id: str, name: str | None) -> bool:
    """Organizations of one person are named by e-mail: spaces around it and capitals don't count."""
    organization = session.get_one(Organization, organization_id)
    return name is None or organization.name.casefold() == name.strip().casefold()


def all_people(session: Session) -> list[Person]:
    return [_person(account) for account in session.scalars(select(Account).order_by(Account.email))]


def note_failed_login(session: Session, email: str | None, address: str, why: str) -> None:
    """What was typed is only kept if it is an account's e-mail: people type passwords into the wrong field."""
    account = None if email is None else _find(session, email)
    entry = AuditEntry(
        AuditAction.LOGIN_FAILED,
        None if account is None else account.organization_id,
        account_id=None if account is None else account.id,
        account="" if account is None else account.email,
        address=address,
        detail=why if account or email is None else "unknown e-mail",
    )
    note(session, entry)


def people_of(session: Session, organization_id: str, skip: int, limit: int) -> tuple[list[Person], int]:
    """One page of an organization's accounts by e-mail, and how many there are in all."""
    mine = Account.organization_id == organization_id
    page = select(Account).where(mine).order_by(Account.email).offset(skip).limit(limit)
    count = session.scalar(select(func.count()).select_from(Account).where(mine)) or 0
    return [_person(account) for account in session.scalars(page)], count


def count_accounts(session: Session) -> int:
    return session.scalar(select(func.count()).select_from(Account)) or 0


def change_password(session: Session, account_id: str, password: str | HashedPassword) -> None:
    """Older access tokens of the account end with this."""
    password_hash = hashed(password).text  # before the first write, which keeps every other writer out
    account = session.get_one(Account, account_id)
    account.password_hash = password_hash
    account.login_version += 1


def change_full_name(session: Session, account_id: str, full_name: str) -> None:
    session.get_one(Account, account_id).full_name = full_name


def login_versions(session: Session) -> dict[str, int]:
    """The login version of every active account; what isn't in it may not stay connected."""
    rows = session.execute(select(Account.id, Account.login_version).where(Account.is_active))
    return {row.id: row.login_version for row in rows}
