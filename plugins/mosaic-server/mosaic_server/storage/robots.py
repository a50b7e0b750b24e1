"""Reading and writing robots and their tokens. Every function runs inside one transaction on a worker thread."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from mosaic_server.security.robot_tokens import hash_of_token, new_robot_token, token_matches
from mosaic_server.storage.tables import RobotRow


class RobotAuthType(IntEnum):
    """Ways in which a robot proves who it is; the numbers of the original server."""

    NO_AUTHORIZATION = 0
    SIMPLE_TOKEN = 1


@dataclass(frozen=True, slots=True)
class RobotRecord:
    """A robot as the rest of the server sees it."""

    id: str
    organization_id: str
    name: str
    description: str
    auth_type: RobotAuthType
    has_token: bool
    connector_config: str | None
    catalogue: str | None


def _record(robot: RobotRow) -> RobotRecord:
    return RobotRecord(
        id=robot.id,
        organization_id=robot.organization_id,
        name=robot.name,
        description=robot.description,
        auth_type=RobotAuthType(robot.auth_type),
        has_token=robot.token_hash is not None,
        connector_config=robot.connector_config,
        catalogue=robot.catalogue,
    )


def add_robot(
    session: Session,
    organization_id: str,
    name: str,
    description: str = "",
    auth_type: RobotAuthType = RobotAuthType.SIMPLE_TOKEN,
    connector_config: str | None = None,
) -> RobotRecord:
    """A new robot; it can't connect before :func:`renew_token` made a token (unless it needs none)."""
    robot = RobotRow(
        organization_id=organization_id,
        name=name,
        description=description,
        auth_type=int(auth_type),
        connector_config=connector_config,
    )
    session.add(robot)
    session.flush()
    return _record(robot)


def robot_by_id(session: Session, robot_id: str) -> RobotRecord | None:
    robot = session.get(RobotRow, robot_id)
    return None if robot is None else _record(robot)


def robots_by_id(session: Session, robot_ids: list[str]) -> dict[str, RobotRecord]:
    rows = session.scalars(select(RobotRow).where(RobotRow.id.in_(robot_ids)))
    return {robot.id: _record(robot) for robot in rows}


def robots_of(session: Session, organization_id: str, skip: int, limit: int) -> tuple[list[RobotRecord], int]:
    """One page of an organization's robots by name, and how many there are in all."""
    mine = RobotRow.organization_id == organization_id
    page = select(RobotRow).where(mine).order_by(RobotRow.name, RobotRow.id).offset(skip).limit(limit)
    count = session.scalar(select(func.count()).select_from(RobotRow).where(mine)) or 0
    return [_record(robot) for robot in session.scalars(page)], count


def all_robots(session: Session) -> list[RobotRecord]:
    return [_record(robot) for robot in session.scalars(select(RobotRow).order_by(RobotRow.name, RobotRow.id))]


def change_robot(
    session: Session,
    robot_id: str,
    *,
    name: str | None = None,
    description: str | None = None,
    auth_type: RobotAuthType | None = None,
    connector_config: str | None = None,
) -> None:
    robot = session.get_one(RobotRow, robot_id)
    robot.name = robot.name if name is None else name
    robot.description = robot.description if description is None else description
    robot.auth_type = robot.auth_type if auth_type is None else int(auth_type)
    robot.connector_config = robot.connector_config if connector_config is None else connector_config


def keep_connector_config(session: Session, robot_id: str, connector_config: str | None) -> None:
    """What people say the robot has; ``None`` forgets it."""
    session.get_one(RobotRow, robot_id).connector_config = connector_config


def remove_robot(session: Session, robot_id: str) -> None:
    session.delete(session.get_one(RobotRow, robot_id))


def renew_token(session: Session, robot_id: str) -> str:
    """A new token, the only time it is seen; the old one is refused from now on."""
    token = new_robot_token()
    session.get_one(RobotRow, robot_id).token_hash = hash_of_token(token)
    return token


def keep_catalogue(session: Session, robot_id: str, catalogue: str) -> None:
    """Remember what the robot announced; a robot that was removed meanwhile is left alone."""
    robot = session.get(RobotRow, robot_id)
    if robot is not None:
        robot.catalogue = catalogue


@dataclass(frozen=True, slots=True)
class RobotLogin:
    """The robot that presented itself, and a fingerprint of what it was admitted with."""

    robot: RobotRecord
    admitted_by: str


def log_in_robot(session: Session, robot_id: str, token: str | None) -> RobotLogin | RobotRecord | None:
    """Its login; the bare record when the token is wrong; ``None`` when there is no such robot.

    The robot's own auth type decides, never the message.
    """
    robot = session.get(RobotRow, robot_id)
    if robot is None:
        return None
    record = _record(robot)
    if record.auth_type is RobotAuthType.NO_AUTHORIZATION or token_matches(robot.token_hash, token):
        return RobotLogin(record, _admission(robot))
    return record


def _admission(robot: RobotRow) -> str:
    return f"{robot.auth_type}:{robot.token_hash or ''}"


def admissions(session: Session) -> dict[str, str]:
    """What each robot must have been admitted with to stay connected."""
    return {robot.id: _admission(robot) for robot in session.scalars(select(RobotRow))}
