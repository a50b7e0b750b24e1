"""Whether a robot's token is right, without connecting: on the socket the newest connection wins, and a diagnosis
must not put a running robot off.
"""

from __future__ import annotations

import logging
import time
from typing import Any

from fastapi import APIRouter, Request
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.ids import is_uuid
from mosaic_server.rest.envelope import ApiError, Envelope
from mosaic_server.rest.password_attempts import address_of, must_not_guess_on
from mosaic_server.rest.signed_in import ServicesDep
from mosaic_server.rest.texts import NO_NUL
from mosaic_server.storage.robots import RobotLogin, log_in_robot

_log = logging.getLogger(__name__)

router = APIRouter(prefix="/api/v1/robots", tags=["robots"])


class RobotCredentials(WireModel):
    """The credentials that the robot would send on its socket."""

    robot_id: str
    token: str | None = Field(default=None, max_length=1000, pattern=NO_NUL, repr=False)


class RobotChecked(WireModel):
    """A robot's credentials were checked. ``iceServers``: as the robot would get them, with credentials that
    end soon.
    """

    robot_id: str
    name: str
    is_online: bool
    ice_servers: list[dict[str, Any]]


@router.post("/auth/check")
async def check_robot(said: RobotCredentials, request: Request, services: ServicesDep) -> Envelope[RobotChecked]:
    """For a robot's own diagnosis; changes nothing. 429 after many wrong tokens of one address."""
    address = address_of(request)
    must_not_guess_on(services, None, address)
    known = is_uuid(said.robot_id)
    login = await services.database.run(log_in_robot, said.robot_id.lower(), said.token) if known else None
    if not isinstance(login, RobotLogin):
        services.login_limits.failed(None, address, time.monotonic())
        _log.warning("the credentials of a robot, checked from %s, were wrong", address)
        if login is None:
            raise ApiError(ResultCode.ROBOT_NOT_FOUND, code="auth.unknown_robot")
        raise ApiError(ResultCode.AUTHENTICATION_FAILED)
    seen = services.exchange.switchboard.robot(login.robot.id)
    servers = await services.authorizer.ice_servers(login.robot.id)
    return Envelope(
        resultData=RobotChecked(
            robot_id=login.robot.id,
            name=login.robot.name,
            is_online=seen is not None and seen.is_online,
            ice_servers=[server.wire() for server in servers],
        )
    )
