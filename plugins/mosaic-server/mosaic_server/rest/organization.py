"""The organization of whoever asks: its name, and the role that plain accounts have where nothing was granted."""

from __future__ import annotations

from fastapi import APIRouter

from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import Envelope
from mosaic_server.rest.role_changes import CHANGES, role_changes
from mosaic_server.rest.signed_in import AdminDep, PersonDep, ServicesDep, actor_of
from mosaic_server.roles import Role
from mosaic_server.services import Services
from mosaic_server.storage.members import organization_of, set_default_role

router = APIRouter(prefix="/api/v1/organization", tags=["organization"], responses=CHANGES)


class OrganizationDto(WireModel):
    """An organization and its default role. ``defaultRole`` is the role of accounts that are no administrators, on
    robots where nothing was granted.
    """

    id: str
    name: str
    default_role: Role


class OrganizationChange(WireModel):
    default_role: Role


@router.get("")
async def show_organization(person: PersonDep, services: ServicesDep) -> Envelope[OrganizationDto]:
    return await _shown(services, person.organization_id)


@router.put("")
async def change_organization(
    change: OrganizationChange, admin: AdminDep, services: ServicesDep
) -> Envelope[OrganizationDto]:
    """Connections of accounts whose role changes by this are closed, to come back with the new one."""
    with role_changes():
        await services.database.run(set_default_role, admin.organization_id, change.default_role, actor_of(admin))
    await services.revoke()
    return await _shown(services, admin.organization_id)


async def _shown(services: Services, organization_id: str) -> Envelope[OrganizationDto]:
    found = await services.database.run(organization_of, organization_id)
    return Envelope(resultData=OrganizationDto(id=found.id, name=found.name, default_role=found.default_role))
