"""The tables. Ids are UUID text and times whole milliseconds since 1970 (UTC): every database agrees on those."""

from __future__ import annotations

import time
from uuid import uuid4

from sqlalchemy import BigInteger, ForeignKey, Index, Integer, LargeBinary, String, Text, UniqueConstraint, false
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


def new_id() -> str:
    return str(uuid4())


def now_ms() -> int:
    """Wall clock: only for people to read, never for decisions about live connections."""
    return time.time_ns() // 1_000_000


class Base(DeclarativeBase):
    """The base of all tables."""


class Stamped:
    """Columns that every table has."""

    id: Mapped[str] = mapped_column(String(36), primary_key=True, default=new_id)
    created_at_ms: Mapped[int] = mapped_column(BigInteger, default=now_ms)
    updated_at_ms: Mapped[int] = mapped_column(BigInteger, default=now_ms, onupdate=now_ms)


class Organization(Stamped, Base):
    """An organization, which owns robots. Every account that signs up gets one of its own."""

    __tablename__ = "organization"
    name: Mapped[str] = mapped_column(String(254), unique=True)
    default_role: Mapped[str] = mapped_column(String(20), default="operator", server_default="operator")
    """The role of plain accounts on robots where nothing else was granted."""


class Account(Stamped, Base):
    """A person (or program) who operates robots."""

    __tablename__ = "account"
    organization_id: Mapped[str] = mapped_column(ForeignKey("organization.id", ondelete="CASCADE"), index=True)
    email: Mapped[str] = mapped_column(String(254), unique=True)
    full_name: Mapped[str] = mapped_column(String(200), default="")
    password_hash: Mapped[str] = mapped_column(String(200))
    is_active: Mapped[bool] = mapped_column(default=True)
    is_organization_admin: Mapped[bool] = mapped_column(default=True)
    is_program: Mapped[bool] = mapped_column(default=False, server_default=false())
    """It can never pass for a person on a robot."""
    login_version: Mapped[int] = mapped_column(default=1)
    """Raised when the password changes or the account is disabled: older access tokens end there."""


class RobotRow(Stamped, Base):
    """A robot as the server knows it; whether it is online is the switchboard's knowledge."""

    __tablename__ = "robot"
    organization_id: Mapped[str] = mapped_column(ForeignKey("organization.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(200))
    description: Mapped[str] = mapped_column(Text, default="")
    auth_type: Mapped[int] = mapped_column(default=1)
    token_hash: Mapped[str | None] = mapped_column(String(64), default=None)
    """SHA-256 of the token in hex. The token has 256 random bits, so a slow hash would add nothing."""
    connector_config: Mapped[str | None] = mapped_column(Text, default=None)
    catalogue: Mapped[str | None] = mapped_column(Text, default=None)
    """The short catalogue that the robot last announced, as JSON."""


class Tab(Stamped, Base):
    """A page of an original dashboard, which everybody in the organization sees."""

    __tablename__ = "tab"
    organization_id: Mapped[str] = mapped_column(ForeignKey("organization.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(200))
    tab_config: Mapped[str] = mapped_column(Text, default='{"widgets":[]}')
    """JSON of the dashboard's own making; the server only passes it on."""


class OccupancyMap(Stamped, Base):
    """A map with its two files. Only routes that hand a file out load it."""

    __tablename__ = "occupancy_map"
    organization_id: Mapped[str] = mapped_column(ForeignKey("organization.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(200))
    pgm_name: Mapped[str] = mapped_column(String(100))
    yaml_name: Mapped[str] = mapped_column(String(100))
    pgm: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    yaml: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class RobotGrant(Stamped, Base):
    """The role of one account on one robot, where it isn't the default."""

    __tablename__ = "robot_grant"
    __table_args__ = (UniqueConstraint("robot_id", "account_id"),)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.id", ondelete="CASCADE"))
    account_id: Mapped[str] = mapped_column(ForeignKey("account.id", ondelete="CASCADE"), index=True)
    role: Mapped[str] = mapped_column(String(20))


class IssuedTicket(Stamped, Base):
    """The ticket by which a robot was told of an operator, kept while their connection may live. ``id`` is the
    connection's.

    The account is no foreign key: that it is gone is a reason to close its connections.
    """

    __tablename__ = "issued_ticket"
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.id", ondelete="CASCADE"), index=True)
    account_id: Mapped[str] = mapped_column(String(36), index=True)
    session_id: Mapped[str] = mapped_column(String(36))
    role: Mapped[str] = mapped_column(String(20))
    is_program: Mapped[bool]
    is_over: Mapped[bool] = mapped_column(default=False)
    """Superseded by newer ones: the connection is closed if it still lives."""


class AuditEntryRow(Base):
    """One line of the audit log. No foreign keys: it outlives what it tells of."""

    __tablename__ = "audit_entry"
    __table_args__ = (
        Index("ix_audit_entry_organization_id_id", "organization_id", "id"),
        Index("ix_audit_entry_action_id", "action", "id"),
    )
    id: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    at_ms: Mapped[int] = mapped_column(BigInteger, default=now_ms, index=True)
    action: Mapped[str] = mapped_column(String(40))
    organization_id: Mapped[str | None] = mapped_column(String(36), default=None)
    actor: Mapped[str] = mapped_column(String(254), default="")
    """The e-mail of who did it, or "command line"."""
    account_id: Mapped[str | None] = mapped_column(String(36), default=None)
    account: Mapped[str] = mapped_column(String(254), default="")
    robot_id: Mapped[str | None] = mapped_column(String(36), default=None)
    robot: Mapped[str] = mapped_column(String(200), default="")
    role: Mapped[str] = mapped_column(String(20), default="")
    address: Mapped[str] = mapped_column(String(64), default="")
    detail: Mapped[str] = mapped_column(String(200), default="")


class IceServerRow(Stamped, Base):
    """One ICE server that is handed to every operator and to robots that take it."""

    __tablename__ = "ice_server"
    urls: Mapped[str] = mapped_column(Text)
    """JSON array of URLs."""
    username: Mapped[str | None] = mapped_column(String(512), default=None)
    credential: Mapped[str | None] = mapped_column(String(512), default=None)
    secret: Mapped[str | None] = mapped_column(String(512), default=None)
    """Shared with the TURN server. In clear, for credentials are made with it; it is never handed out."""


class PairedDevice(Stamped, Base):
    """An account that came by pairing on the robot's own network. ``id`` is the account's."""

    __tablename__ = "paired_device"
    id: Mapped[str] = mapped_column(ForeignKey("account.id", ondelete="CASCADE"), primary_key=True)
    address: Mapped[str] = mapped_column(String(64), default="")
    """From where it was paired."""


class PairingOffer(Stamped, Base):
    """A PIN and a code that pair one device. In the database, so that the command line can make one for the server."""

    __tablename__ = "pairing_offer"
    pin_hash: Mapped[str | None] = mapped_column(String(64), default=None)
    """``None``: void, after too many wrong ones."""
    code_hash: Mapped[str] = mapped_column(String(64))
    role: Mapped[str | None] = mapped_column(String(20), default=None)
    """``None``: supervisor for the first device, operator for the others."""
    expires_at_ms: Mapped[int] = mapped_column(BigInteger)
    wrong_pins: Mapped[int] = mapped_column(default=0)
    taken_by: Mapped[str | None] = mapped_column(String(36), default=None)


class ServerKey(Stamped, Base):
    """Key material of this server, made at its first start."""

    __tablename__ = "server_key"
    __table_args__ = (UniqueConstraint("purpose"),)
    purpose: Mapped[str] = mapped_column(String(50))
    secret: Mapped[bytes] = mapped_column(LargeBinary)
