"""Takes what people say a robot has, for robots that announce no catalogue: whoever may operate one may describe it."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.connector_config import MAX_LENGTH, BadConnectorConfig, checked_connector_config
from mosaic_server.rest.envelope import ApiError, DoneMessage, Envelope
from mosaic_server.rest.robots import robot_of
from mosaic_server.rest.signed_in import PersonDep, ServicesDep
from mosaic_server.rest.texts import NO_NUL
from mosaic_server.roles import Role
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.grants import roles_of_account
from mosaic_server.storage.robots import keep_connector_config

router = APIRouter(prefix="/api/v1/robots", tags=["robots"])


class Description(WireModel):
    """What people wrote down of a robot: ``{"connectors": [{"connectorId": …}, …]}`` as a JSON text; further keys of a
    connector are kept. null forgets what was stored, so that what follows from the robot's catalogue counts again.
    """

    connector_config: str | None = Field(max_length=MAX_LENGTH, pattern=NO_NUL)


@router.put("/{robot_id}/connector-config")
async def describe_robot(
    robot_id: str, description: Description, person: PersonDep, services: ServicesDep
) -> Envelope[DoneMessage]:
    """Ours. For operators and supervisors of this robot; 403 for observers."""
    robot = await robot_of(services, person, robot_id)
    await _must_operate(services, person, robot.id)
    try:
        kept = None if description.connector_config is None else checked_connector_config(description.connector_config)
    except BadConnectorConfig as error:
        raise ApiError(ResultCode.INVALID_FORMAT, str(error)) from error
    await services.database.run(keep_connector_config, robot.id, kept)
    return Envelope(resultData=DoneMessage(message="description forgotten" if kept is None else "description saved"))


async def _must_operate(services: Services, person: Person, robot_id: str) -> None:
    roles = await services.database.run(roles_of_account, person.id, [robot_id])
    if roles.get(robot_id, Role.OBSERVER) is Role.OBSERVER:
        raise ApiError(ResultCode.ACCESS_DENIED, "observers of a robot may not describe it")
