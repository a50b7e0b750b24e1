"""Paired devices and the offers that pair them. Every function runs inside one transaction on a worker thread.

A device is an account without a password anybody knows, so that roles, tickets and revocation are those of accounts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from uuid import uuid4

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from mosaic_server.roles import Role
from mosaic_server.security.pairing import LIFETIME_S, Offer, PairingSecrets, PairingVerdict, hash_of, new_secrets
from mosaic_server.security.passwords import nobodys_password
from mosaic_server.security.robot_tokens import hash_of_token
from mosaic_server.storage.accounts import Membership, Person, add_account
from mosaic_server.storage.audit import AuditAction, AuditEntry, note
from mosaic_server.storage.grants import Actor, role_on, set_role
from mosaic_server.storage.organizations import add_organization
from mosaic_server.storage.tables import (
    Account,
    AuditEntryRow,
    Organization,
    PairedDevice,
    PairingOffer,
    RobotGrant,
    RobotRow,
    now_ms,
)

ORGANIZATION = "this robot"
_ADDRESSES = "paired.invalid"
"""Devices have no mailbox; RFC 2606 keeps this one from ever being one."""
MOST_OPEN = 8
PAIRING = Actor("pairing")


@dataclass(frozen=True, slots=True)
class ListedDevice:
    """A paired device for people to read. Times are milliseconds since 1970; ``None``: never connected."""

    id: str
    name: str
    role: Role | None
    address: str
    paired_at_ms: int
    connected_at_ms: int | None


def adopt_robot(session: Session, robot_id: str, name: str, token: str) -> None:
    """This server has this one robot, with this token. One of another id was the same machine: its grants go over."""
    organization = session.scalar(select(Organization).where(Organization.name == ORGANIZATION))
    if organization is None:
        organization = add_organization(session, ORGANIZATION)
    robot = session.get(RobotRow, robot_id)
    if robot is None:
        robot = RobotRow(id=robot_id, organization_id=organization.id, name=name)
        session.add(robot)
    robot.name, robot.auth_type, robot.token_hash = name, 1, hash_of_token(token)
    session.flush()
    for other in session.scalars(select(RobotRow).where(RobotRow.id != robot_id)):
        for grant in session.scalars(select(RobotGrant).where(RobotGrant.robot_id == other.id)):
            grant.robot_id = robot_id
        session.flush()
        session.delete(other)


def open_offer(session: Session, role: Role | None = None) -> tuple[str, PairingSecrets]:
    """A new offer's id and what to show. ``role=None``: supervisor for the first device of all, operator after it."""
    session.execute(delete(PairingOffer).where(PairingOffer.expires_at_ms <= now_ms() - _ms(LIFETIME_S)))
    open_ones = _open(session)
    for oldest in open_ones[: max(0, len(open_ones) + 1 - MOST_OPEN)]:
        session.delete(oldest)
    shown = new_secrets()
    offer = PairingOffer(
        pin_hash=hash_of(shown.pin),
        code_hash=hash_of(shown.code),
        role=role,
        expires_at_ms=now_ms() + _ms(LIFETIME_S),
    )
    session.add(offer)
    session.flush()
    return offer.id, shown


def withdraw_offer(session: Session, offer_id: str) -> None:
    session.execute(delete(PairingOffer).where(PairingOffer.id == offer_id))


@dataclass(frozen=True, slots=True)
class OfferState:
    """The state of an offer to pair a device. ``device``: who took it. Neither open nor taken: it is too old."""

    is_open: bool
    has_pin: bool
    device: str | None = None


def offer_state(session: Session, offer_id: str) -> OfferState:
    offer = session.get(PairingOffer, offer_id)
    if offer is None:
        return OfferState(False, False)
    is_open = offer.taken_by is None and offer.expires_at_ms > now_ms()
    return OfferState(is_open, is_open and offer.pin_hash is not None, offer.taken_by)


@dataclass(frozen=True, slots=True)
class NewDevice:
    """The device that was just paired, and the robot that it is paired with."""

    person: Person
    role: Role
    robot_id: str
    robot_name: str


def pair(
    session: Session, judge: Callable[[Sequence[Offer]], PairingVerdict], name: str, address: str
) -> NewDevice | PairingVerdict:
    """The new device of whoever met an open offer; else what was judged, and that is counted."""
    rows = {row.id: row for row in _open(session)}
    verdict = judge([Offer(row.id, row.pin_hash, row.code_hash, row.wrong_pins) for row in rows.values()])
    for offer_id, wrong in verdict.wrong_pins.items():
        rows[offer_id].wrong_pins = wrong
        if verdict.is_void(offer_id):
            rows[offer_id].pin_hash = None
    if verdict.accepted is None:
        return verdict
    offer = rows[verdict.accepted]
    device = _added(session, offer, name, address)
    offer.taken_by = device.person.id
    return device


def _added(session: Session, offer: PairingOffer, name: str, address: str) -> NewDevice:
    robot = session.scalars(select(RobotRow)).one()
    role = Role(offer.role) if offer.role else Role.OPERATOR if count_devices(session) else Role.SUPERVISOR
    email = f"{uuid4().hex[:12]}@{_ADDRESSES}"
    person = add_account(session, email, nobodys_password(), name, membership=Membership(robot.organization_id))
    session.add(PairedDevice(id=person.id, address=address))
    session.flush()
    note(
        session,
        AuditEntry(
            AuditAction.ACCOUNT_ADDED,
            robot.organization_id,
            actor=PAIRING.name,
            account_id=person.id,
            account=email,
            address=address,
            detail=f"paired device {name!r}",
        ),
    )
    set_role(session, robot.id, person.id, role, PAIRING)
    return NewDevice(person, role, robot.id, robot.name)


def devices(session: Session) -> list[ListedDevice]:
    """All paired ones, the oldest first."""
    robot = session.scalar(select(RobotRow))
    connected = (
        select(AuditEntryRow.account_id, func.max(AuditEntryRow.at_ms).label("at_ms"))
        .where(AuditEntryRow.action == AuditAction.CONNECTION_MADE)
        .group_by(AuditEntryRow.account_id)
        .subquery()
    )
    rows = session.execute(
        select(Account.id, Account.full_name, PairedDevice.address, PairedDevice.created_at_ms, connected.c.at_ms)
        .join(PairedDevice, PairedDevice.id == Account.id)
        .outerjoin(connected, connected.c.account_id == Account.id)
        .order_by(PairedDevice.created_at_ms, Account.id)
    )
    return [
        ListedDevice(row.id, row.full_name, _role(session, row.id, robot), row.address, row.created_at_ms, row.at_ms)
        for row in rows
    ]


def _role(session: Session, account_id: str, robot: RobotRow | None) -> Role | None:
    found = None if robot is None else role_on(session, account_id, robot.id)
    return None if found is None else found.standing.role


def count_devices(session: Session) -> int:
    return session.scalar(select(func.count()).select_from(PairedDevice)) or 0


def change_device_role(session: Session, device_id: str, role: Role, actor: Actor) -> None:
    """Raises :class:`LastSupervisor`."""
    set_role(session, session.scalars(select(RobotRow)).one().id, device_id, role, actor)


def is_device(session: Session, account_id: str) -> bool:
    return session.get(PairedDevice, account_id) is not None


def revoke_device(session: Session, device_id: str, actor: Actor) -> None:
    """It is signed out wherever it is, and its connections are closed. Even the last supervisor's: whoever sits at the
    robot can pair another one."""
    account = session.get_one(Account, device_id)
    entry = AuditEntry(
        AuditAction.ACCOUNT_REMOVED,
        account.organization_id,
        actor=actor.name,
        account_id=account.id,
        account=account.email,
        detail=f"revoked device {account.full_name!r}",
    )
    session.delete(account)
    note(session, entry)


def _open(session: Session) -> list[PairingOffer]:
    """The oldest first."""
    is_open = (PairingOffer.taken_by.is_(None), PairingOffer.expires_at_ms > now_ms())
    return [*session.scalars(select(PairingOffer).where(*is_open).order_by(PairingOffer.created_at_ms))]


def _ms(seconds: float) -> int:
    return int(seconds * 1000)
