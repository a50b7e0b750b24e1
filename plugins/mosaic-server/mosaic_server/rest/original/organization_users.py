"""The accounts of an organization at the addresses of original dashboards, which name an account in the body."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BeforeValidator, Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import MAX_SKIP, ApiError, Created, DoneMessage, Envelope
from mosaic_server.rest.hashing import hashed_for
from mosaic_server.rest.members import NewUser, UserPage, create_user, list_users, member_of
from mosaic_server.rest.role_changes import CHANGES, own_account, role_changes
from mosaic_server.rest.signed_in import AdminDep, ServicesDep, actor_of
from mosaic_server.rest.texts import EMAIL, NAME
from mosaic_server.security.passwords import MAX_PASSWORD_LENGTH, MIN_PASSWORD_LENGTH
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.members import MemberChange, change_member, remove_member

router = APIRouter(prefix="/api/v1/organization/users", tags=["members"], responses=CHANGES)


class NewMember(WireModel):
    email: str = Field(max_length=254, pattern=EMAIL)
    password: str = Field(min_length=MIN_PASSWORD_LENGTH, max_length=MAX_PASSWORD_LENGTH, repr=False)
    full_name: str = Field(default="", max_length=200, pattern=NAME)
    is_organization_admin: bool = False


class ChangedMember(WireModel):
    """Changes to a member, as original dashboards send them. What isn't given stays; an empty password, too, is none:
    forms send their empty fields."""

    id: str
    password: Annotated[str | None, BeforeValidator(lambda given: given or None)] = Field(
        default=None, min_length=MIN_PASSWORD_LENGTH, max_length=MAX_PASSWORD_LENGTH, repr=False
    )
    is_active: bool | None = None
    is_organization_admin: bool | None = None
    full_name: str | None = Field(default=None, max_length=200, pattern=NAME)


class MemberId(WireModel):
    id: str


@router.get("")
async def list_members(
    admin: AdminDep,
    services: ServicesDep,
    skip: Annotated[int, Query(ge=0, le=MAX_SKIP)] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Envelope[UserPage]:
    """As ``GET /api/v1/users``."""
    return await list_users(admin, services, skip, limit)


@router.post("")
async def create_member(new: NewMember, request: Request, admin: AdminDep, services: ServicesDep) -> Envelope[Created]:
    wanted = NewUser(
        email=new.email,
        full_name=new.full_name,
        password=new.password,
        is_organization_admin=new.is_organization_admin,
    )
    made = (await create_user(wanted, request, admin, services)).resultData
    return Envelope(resultData=Created(message=made.message, id=made.id))


@router.put("")
async def change_account(
    change: ChangedMember, request: Request, admin: AdminDep, services: ServicesDep
) -> Envelope[DoneMessage]:
    """A new password ends every log-in of the account. Of the own account only the name can be changed here."""
    person = await member_of(services, admin, change.id)
    if person.id == admin.id:
        _must_keep_own_kind(change, admin)
    wanted = MemberChange(
        is_active=change.is_active,
        is_organization_admin=change.is_organization_admin,
        full_name=change.full_name,
        password=change.password and await hashed_for(request, services, admin.id, change.password),
    )
    with role_changes():
        await services.database.run(change_member, person.id, wanted, actor_of(admin))
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="account saved"))


@router.delete("")
async def delete_account(wanted: MemberId, admin: AdminDep, services: ServicesDep) -> Envelope[DoneMessage]:
    """The account, its grants and its connections; never the own account."""
    person = await member_of(services, admin, wanted.id)
    if person.id == admin.id:
        raise ApiError(ResultCode.CANNOT_DELETE_YOURSELF)
    with role_changes():
        await services.database.run(remove_member, person.id, actor_of(admin))
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="account removed"))


def _must_keep_own_kind(change: ChangedMember, admin: Person) -> None:
    """The original dashboard sends every field of its form, changed or not. The own password takes the current one."""
    if change.password is not None:
        message = "the own password is changed at /api/v1/users/me/password, with the current one"
        raise ApiError(ResultCode.ACCESS_DENIED, message, code="auth.own_account")
    if change.is_active is False or change.is_organization_admin is False:
        raise own_account()
