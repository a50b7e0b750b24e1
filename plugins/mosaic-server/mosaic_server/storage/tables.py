"""The tables. Ids are UUID text and times whole milliseconds since 1970 (UTC): every database agrees on those."""

from __future__ import annotations

import time
from uuid import uuid4

from sqlalchemy import BigInteger, ForeignKey, LargeBinary, String, Text, UniqueConstraint
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
    """Who owns robots. Every account that signs up gets one of its own."""

    __tablename__ = "organization"
    name: Mapped[str] = mapped_column(String(254), unique=True)


class Account(Stamped, Base):
    """A person (or program) who operates robots."""

    __tablename__ = "account"
    organization_id: Mapped[str] = mapped_column(ForeignKey("organization.id", ondelete="CASCADE"), index=True)
    email: Mapped[str] = mapped_column(String(254), unique=True)
    full_name: Mapped[str] = mapped_column(String(200), default="")
    password_hash: Mapped[str] = mapped_column(String(200))
    is_active: Mapped[bool] = mapped_column(default=True)
    is_organization_admin: Mapped[bool] = mapped_column(default=True)
    login_version: Mapped[int] = mapped_column(default=1)
    """Raised when the password changes or the account is disabled: older access tokens end there."""


class Robot(Stamped, Base):
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


class IceServerRow(Stamped, Base):
    """One ICE server that is handed to every operator and to robots that take it."""

    __tablename__ = "ice_server"
    urls: Mapped[str] = mapped_column(Text)
    """JSON array of URLs."""
    username: Mapped[str | None] = mapped_column(String(512), default=None)
    credential: Mapped[str | None] = mapped_column(String(512), default=None)


class ServerKey(Stamped, Base):
    """Key material of this server, made at its first start."""

    __tablename__ = "server_key"
    __table_args__ = (UniqueConstraint("purpose"),)
    purpose: Mapped[str] = mapped_column(String(50))
    secret: Mapped[bytes] = mapped_column(LargeBinary)
