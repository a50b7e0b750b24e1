"""The robots of the organization of whoever asks. A robot of strangers is as unknown as one that never was."""

from __future__ import annotations

import time
from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import RobotStatus
from mosaic_core.words.wire_model import WireModel
from mosaic_server.connector_config import MAX_LENGTH, derived_connector_config
from mosaic_server.ids import is_uuid
from mosaic_server.rest.envelope import MAX_SKIP, ApiError, Created, DoneMessage, Envelope
from mosaic_server.rest.signed_in import AdminDep, PersonDep, ServicesDep
from mosaic_server.rest.texts import NAME, NO_NUL
from mosaic_server.roles import Role
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.grants import roles_of_account
from mosaic_server.storage.robots import (
    RobotAuthType,
    RobotRecord,
    add_robot,
    change_robot,
    remove_robot,
    renew_token,
    robot_by_id,
    robots_of,
)
from mosaic_server.switchboard.events import RobotRemembered, RobotRemoved

router = APIRouter(prefix="/api/v1/robots", tags=["robots"])


class RobotInfo(WireModel):
    """A robot, as whoever asks sees it. ``status`` and ``authType`` are the numbers of the original.

    ``connectorConfig`` is what people stored, else what follows from the robot's catalogue. Ours:
    ``connectorConfigIsStored``, ``isOnline``, and ``myRole``, what whoever asks may do with this robot.
    """

    id: str
    name: str
    description: str
    status: int
    auth_type: int
    organization_id: str
    connector_config: str | None
    connector_config_is_stored: bool
    is_online: bool
    my_role: Role


class RobotPage(WireModel):
    data: list[RobotInfo]
    count: int


class NewRobot(WireModel):
    """A robot that shall be made. ``status`` of original dashboards is accepted and ignored: the robot says it
    itself.
    """

    name: str = Field(min_length=1, max_length=200, pattern=NAME)
    description: str = Field(default="", max_length=10_000, pattern=NO_NUL)
    auth_type: RobotAuthType = RobotAuthType.SIMPLE_TOKEN
    connector_config: str | None = Field(default=None, max_length=MAX_LENGTH, pattern=NO_NUL)


class RobotChange(WireModel):
    """Changes to a robot. What isn't given stays."""

    name: str | None = Field(default=None, min_length=1, max_length=200, pattern=NAME)
    description: str | None = Field(default=None, max_length=10_000, pattern=NO_NUL)
    auth_type: RobotAuthType | None = None
    connector_config: str | None = Field(default=None, max_length=MAX_LENGTH, pattern=NO_NUL)


class RobotId(WireModel):
    robot_id: str


class RobotToken(WireModel):
    token: str = Field(repr=False)


@router.get("")
async def list_robots(
    person: PersonDep,
    services: ServicesDep,
    skip: Annotated[int, Query(ge=0, le=MAX_SKIP)] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Envelope[RobotPage]:
    page, count = await services.database.run(robots_of, person.organization_id, skip, limit)
    return Envelope(resultData=RobotPage(data=await _infos(services, person, page), count=count))


@router.post("")
async def create_robot(new: NewRobot, admin: AdminDep, services: ServicesDep) -> Envelope[Created]:
    robot = await services.database.run(
        add_robot, admin.organization_id, new.name, new.description, new.auth_type, new.connector_config
    )
    services.exchange.handle(RobotRemembered(robot.id, robot.organization_id))
    return Envelope(resultData=Created(message="robot created", id=robot.id))


@router.post("/auth/simple-token")
async def create_token(wanted: RobotId, admin: AdminDep, services: ServicesDep) -> Envelope[RobotToken]:
    """A new token, shown this once. The old one is refused from now on, and a robot connected with it is put off."""
    return await renewed_token(wanted.robot_id, admin, services)


async def renewed_token(robot_id: str, admin: Person, services: Services) -> Envelope[RobotToken]:
    """What either route for tokens answers."""
    robot = await robot_of(services, admin, robot_id)
    if robot.auth_type is not RobotAuthType.SIMPLE_TOKEN:
        raise ApiError(ResultCode.INVALID_ROBOT_AUTH_TYPE, "this robot needs no token", code="auth.forbidden")
    token = await services.database.run(renew_token, robot.id)
    await services.revoke()
    return Envelope(resultData=RobotToken(token=token))


@router.get("/{robot_id}")
async def show_robot(robot_id: str, person: PersonDep, services: ServicesDep) -> Envelope[RobotInfo]:
    (info,) = await _infos(services, person, [await robot_of(services, person, robot_id)])
    return Envelope(resultData=info)


@router.put("/{robot_id}")
async def update_robot(
    robot_id: str, change: RobotChange, admin: AdminDep, services: ServicesDep
) -> Envelope[DoneMessage]:
    robot = await robot_of(services, admin, robot_id)
    given = change.connector_config
    # Forms of original dashboards send back all that they were shown; what was derived stays so.
    is_news = robot.connector_config is not None or given != _derived(services, robot.id)
    await services.database.run(
        change_robot,
        robot.id,
        name=change.name,
        description=change.description,
        auth_type=change.auth_type,
        connector_config=given if is_news else None,
    )
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="robot saved"))


@router.delete("/{robot_id}")
async def delete_robot(robot_id: str, admin: AdminDep, services: ServicesDep) -> Envelope[DoneMessage]:
    robot = await robot_of(services, admin, robot_id)
    await services.database.run(remove_robot, robot.id)
    services.exchange.handle(RobotRemoved(robot.id, time.monotonic()))
    return Envelope(resultData=DoneMessage(message="robot removed"))


@router.get("/{robot_id}/catalogue")
async def show_catalogue(robot_id: str, person: PersonDep, services: ServicesDep) -> Envelope[dict[str, Any] | None]:
    """What the robot last announced, without message schemas; null for a robot that never did."""
    robot = await robot_of(services, person, robot_id)
    known = services.exchange.switchboard.robot(robot.id)
    catalogue = None if known is None else known.catalogue
    return Envelope(resultData=None if catalogue is None else catalogue.wire())


async def robot_of(services: Services, person: Person, robot_id: str) -> RobotRecord:
    """The robot, if it belongs to the person's organization."""
    known = is_uuid(robot_id)  # databases choke on some other texts
    robot = await services.database.run(robot_by_id, robot_id.lower()) if known else None
    if robot is None or robot.organization_id != person.organization_id:
        raise ApiError(ResultCode.ROBOT_NOT_FOUND, "no such robot", code="auth.unknown_robot")
    return robot


async def _infos(services: Services, person: Person, robots: list[RobotRecord]) -> list[RobotInfo]:
    roles = await services.database.run(roles_of_account, person.id, [robot.id for robot in robots])
    # an account that was disabled within this very request has no role; it may look once more
    return [_info(services, robot, roles.get(robot.id, Role.OBSERVER)) for robot in robots]


def _info(services: Services, robot: RobotRecord, my_role: Role) -> RobotInfo:
    known = services.exchange.switchboard.robot(robot.id)
    return RobotInfo(
        id=robot.id,
        name=robot.name,
        description=robot.description,
        status=int(RobotStatus.DISCONNECTED if known is None else known.status),
        auth_type=int(robot.auth_type),
        organization_id=robot.organization_id,
        connector_config=robot.connector_config or _derived(services, robot.id),
        connector_config_is_stored=bool(robot.connector_config),
        is_online=known is not None and known.is_online,
        my_role=my_role,
    )


def _derived(services: Services, robot_id: str) -> str | None:
    """What follows from the catalogue that the robot last announced."""
    known = services.exchange.switchboard.robot(robot_id)
    return None if known is None or known.catalogue is None else derived_connector_config(known.catalogue)
