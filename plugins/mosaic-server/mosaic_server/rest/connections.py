"""Making peer connections, and the ICE servers for them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from uuid import uuid4

from fastapi import APIRouter, Request
from pydantic import Field

from mosaic_core.machines.peers.home_address import leads_home
from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import OperatorIdentity
from mosaic_core.words.wire_model import WireModel
from mosaic_server.ids import is_uuid
from mosaic_server.rest.envelope import ApiError, Envelope
from mosaic_server.rest.password_attempts import address_of
from mosaic_server.rest.signed_in import PersonDep, ServicesDep
from mosaic_server.roles import Role
from mosaic_server.services import Services
from mosaic_server.sockets.authorizer import identity_of
from mosaic_server.storage.accounts import Person, shown_name
from mosaic_server.storage.grants import roles_of_account
from mosaic_server.storage.issued_tickets import NoAccess, WantedTicket, record_tickets
from mosaic_server.storage.robots import robots_by_id
from mosaic_server.switchboard.effects import ConnectionsRefused
from mosaic_server.switchboard.events import ConnectionsRequested, WantedConnection

router = APIRouter(prefix="/api/v1", tags=["connections"])


class ConnectionRequest(WireModel):
    """A wish for connections to robots. ``sessionId`` (ours) takes up a session again, for exactly one robot; without
    it each robot gets a new one.
    """

    robot_ids: list[str] = Field(min_length=1, max_length=50)
    session_id: str | None = None


class OriginalIceServer(WireModel):
    """One URL each, for that is how original dashboards have it; empty texts where no credentials are needed."""

    urls: str
    username: str
    credential: str = Field(repr=False)


class MadeConnection(WireModel):
    """A connection to one robot, made. ``rtcSessionId`` is the ``rtcConnectionId`` of every signaling message.
    ``sessionId`` (ours): only toward operators that know several connections per session.
    """

    robot_id: str
    rtc_session_id: str
    session_id: str | None = None


class MadeConnections(WireModel):
    sessions: list[MadeConnection]


@router.get("/webrtc/ice-servers", summary="ICE servers as a bare array")
@router.get("/ice-servers", summary="The same, at its older address")
async def list_ice_servers(person: PersonDep, services: ServicesDep) -> list[OriginalIceServer]:
    """With credentials for this account that end soon: ask again before every peer connection."""
    return [
        OriginalIceServer(urls=url, username=server.username or "", credential=server.credential or "")
        for server in await services.authorizer.ice_servers(person.id)
        for url in server.urls
    ]


@router.post("/webrtc/connection", response_model_exclude_none=True)
async def make_connections(
    body: ConnectionRequest, request: Request, person: PersonDep, services: ServicesDep
) -> Envelope[MadeConnections]:
    """Prepares one connection per robot, all or none. The operator's socket must be open: the offer goes over it.

    The ticket that each robot gets carries the role that the account has on this very robot now.
    """
    robot_ids = list(dict.fromkeys(robot_id.lower() for robot_id in body.robot_ids))
    await _must_belong(services, person, robot_ids)
    plan = [
        WantedTicket(robot_id, str(uuid4()), session_id)
        for robot_id, session_id in zip(robot_ids, _session_ids(body, len(robot_ids)), strict=True)
    ]
    await _refuse_early(services, person, plan)
    wanted = await _with_tickets(services, person, plan, address_of(request))
    asked = ConnectionsRequested(person.id, person.organization_id, wanted, time.monotonic())
    for effect in services.exchange.handle(asked):
        if isinstance(effect, ConnectionsRefused):
            raise _refused(effect)
    knows_sessions = body.session_id is not None or services.exchange.switchboard.knows_sessions(person.id)
    made = [
        MadeConnection(
            robot_id=one.robot_id,
            rtc_session_id=one.connection_id,
            session_id=one.session_id if knows_sessions else None,
        )
        for one in wanted
    ]
    return Envelope(resultData=MadeConnections(sessions=made))


async def _must_belong(services: Services, person: Person, robot_ids: list[str]) -> None:
    for robot_id in robot_ids:
        if not is_uuid(robot_id):
            raise ApiError(ResultCode.ROBOT_NOT_FOUND, "a robot's id is a UUID", code="auth.unknown_robot")
    robots = await services.database.run(robots_by_id, robot_ids)
    for robot_id in robot_ids:
        if robot_id not in robots:
            raise ApiError(ResultCode.ROBOT_NOT_FOUND, f"no robot {robot_id}", code="auth.unknown_robot")
    if any(robot.organization_id != person.organization_id for robot in robots.values()):
        raise ApiError(ResultCode.ROBOT_NOT_IN_SAME_ORGANIZATION, status=403)


def _session_ids(request: ConnectionRequest, count: int) -> list[str]:
    if request.session_id is None:
        return [str(uuid4()) for _ in range(count)]
    if count != 1 or not is_uuid(request.session_id):
        raise ApiError(ResultCode.INVALID_FORMAT, "sessionId is a UUID and goes with exactly one robot")
    return [request.session_id.lower()]


async def _refuse_early(services: Services, person: Person, plan: Sequence[WantedTicket]) -> None:
    """Pages knock again and again on a robot that is away; that writes nothing to the database."""
    roles = await services.database.run(roles_of_account, person.id, [one.robot_id for one in plan])
    who = {robot_id: _identity(person, role) for robot_id, role in roles.items()}
    nobody = _identity(person, Role.OBSERVER)
    wanted = tuple(
        WantedConnection(one.robot_id, one.connection_id, one.session_id, "", who.get(one.robot_id, nobody))
        for one in plan
    )
    asked = ConnectionsRequested(person.id, person.organization_id, wanted, time.monotonic())
    refused = services.exchange.switchboard.refusal(asked)
    if refused is not None:
        raise _refused(refused)


async def _with_tickets(
    services: Services, person: Person, plan: Sequence[WantedTicket], address: str
) -> tuple[WantedConnection, ...]:
    await services.forget_what_is_over()
    try:
        roles = await services.database.run(record_tickets, person.id, plan, address)
    except NoAccess as error:
        raise ApiError(ResultCode.ACCESS_DENIED) from error
    name = await services.database.run(shown_name, person.id)
    servers = await services.authorizer.ice_servers_for([one.robot_id for one in plan])
    wanted = []
    for one, role, ice_servers in zip(plan, roles, servers, strict=True):
        standing = role.standing
        update = {"role": standing.role_if_active.value, "program": standing.is_program}
        operator = identity_of(person, name).model_copy(update=update)
        ticket = services.tickets.issue(
            session_id=one.session_id, robot_id=one.robot_id, peer_id=one.connection_id, operator=operator
        )
        wanted.append(
            WantedConnection(
                one.robot_id, one.connection_id, one.session_id, ticket, operator, ice_servers, leads_home(address)
            )
        )
    return tuple(wanted)


def _identity(person: Person, role: Role) -> OperatorIdentity:
    return identity_of(person).model_copy(update={"role": role.value})


def _refused(refusal: ConnectionsRefused) -> ApiError:
    status = 409 if refusal.code is ResultCode.ROBOT_NOT_READY_TO_CONNECT else None
    return ApiError(refusal.code, code=refusal.reason, status=status)
