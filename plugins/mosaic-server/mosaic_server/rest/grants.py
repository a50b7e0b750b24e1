"""Roles on one robot, for the administrators of its organization."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query

from mosaic_core.words.wire_model import WireModel
from mosaic_server.ids import is_uuid
from mosaic_server.rest.envelope import MAX_SKIP, Envelope
from mosaic_server.rest.robots import robot_of
from mosaic_server.rest.role_changes import CHANGES, role_changes, unknown_account
from mosaic_server.rest.signed_in import AdminDep, ServicesDep, actor_of
from mosaic_server.roles import Role
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.grants import RoleOnRobot, roles_on_robot, set_role

router = APIRouter(prefix="/api/v1/robots/{robot_id}/grants", tags=["grants"], responses=CHANGES)


class Grant(WireModel):
    """An account's role on one robot. ``role`` is what counts on this robot; ``isGranted``: it was granted, otherwise
    it is the account's default.

    A disabled account (``isActive`` false) has no access whatever its role.
    """

    account_id: str
    email: str
    full_name: str
    is_active: bool
    is_program: bool
    is_organization_admin: bool
    role: Role
    is_granted: bool


class GrantPage(WireModel):
    data: list[Grant]
    count: int


class WantedRole(WireModel):
    role: Role


@router.get("")
async def list_grants(
    robot_id: str,
    admin: AdminDep,
    services: ServicesDep,
    skip: Annotated[int, Query(ge=0, le=MAX_SKIP)] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Envelope[GrantPage]:
    """Every account of the organization, by e-mail, with its role on this robot."""
    robot = await robot_of(services, admin, robot_id)
    page, count = await services.database.run(roles_on_robot, robot.id, skip, limit)
    return Envelope(resultData=GrantPage(data=[_grant(one) for one in page], count=count))


@router.put("/{account_id}")
async def grant_role(
    robot_id: str, account_id: Annotated[str, Path()], wanted: WantedRole, admin: AdminDep, services: ServicesDep
) -> Envelope[Grant]:
    """Grant a role on this robot. Connections that the account has there are closed, to come back with the new role.

    409 ``auth.last_supervisor``; 403 ``auth.own_account`` for whoever raises the own role.
    """
    return await _set(services, admin, robot_id, account_id, wanted.role)


@router.delete("/{account_id}")
async def revoke_role(
    robot_id: str, account_id: Annotated[str, Path()], admin: AdminDep, services: ServicesDep
) -> Envelope[Grant]:
    """Take a grant back: the account's default counts again. Fine if nothing was granted. Refused like granting."""
    return await _set(services, admin, robot_id, account_id, None)


async def _set(services: Services, admin: Person, robot_id: str, account_id: str, role: Role | None) -> Envelope[Grant]:
    robot = await robot_of(services, admin, robot_id)
    if not is_uuid(account_id):
        raise unknown_account()
    with role_changes():
        changed = await services.database.run(set_role, robot.id, account_id.lower(), role, actor_of(admin))
    await services.revoke()
    return Envelope(resultData=_grant(changed))


def _grant(one: RoleOnRobot) -> Grant:
    return Grant(
        account_id=one.account_id,
        email=one.email,
        full_name=one.full_name,
        is_active=one.standing.is_active,
        is_program=one.standing.is_program,
        is_organization_admin=one.standing.is_organization_admin,
        role=one.standing.role_if_active,
        is_granted=one.standing.granted is not None,
    )
