"""The accounts of an organization, for its administrators. Those of strangers do not exist for them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.ids import is_uuid
from mosaic_server.rest.envelope import MAX_SKIP, ApiError, Created, DoneMessage, Envelope
from mosaic_server.rest.hashing import hashed_for
from mosaic_server.rest.role_changes import CHANGES, own_account, role_changes, unknown_account
from mosaic_server.rest.signed_in import AdminDep, ServicesDep, actor_of
from mosaic_server.rest.texts import EMAIL, NAME
from mosaic_server.rest.users import UserDto, user_dto
from mosaic_server.security.passwords import MAX_PASSWORD_LENGTH, MIN_PASSWORD_LENGTH, new_password
from mosaic_server.services import Services
from mosaic_server.storage.accounts import AccountExists, Membership, Person, people_of, person_by_id
from mosaic_server.storage.members import MemberChange, add_member, change_member, remove_member

router = APIRouter(prefix="/api/v1/users", tags=["members"], responses=CHANGES)


class UserPage(WireModel):
    data: list[UserDto]
    count: int


class NewUser(WireModel):
    """Without a password one is made and returned, this once."""

    email: str = Field(max_length=254, pattern=EMAIL)
    full_name: str = Field(default="", max_length=200, pattern=NAME)
    password: str | None = Field(
        default=None, min_length=MIN_PASSWORD_LENGTH, max_length=MAX_PASSWORD_LENGTH, repr=False
    )
    is_program: bool = False
    is_organization_admin: bool = False


class CreatedUser(Created):
    """A new account. ``password`` only if the server made it."""

    password: str | None = Field(default=None, repr=False)


class UserChange(WireModel):
    """Changes to an account. What isn't given stays."""

    is_active: bool | None = None
    is_program: bool | None = None
    is_organization_admin: bool | None = None


@router.get("")
async def list_users(
    admin: AdminDep,
    services: ServicesDep,
    skip: Annotated[int, Query(ge=0, le=MAX_SKIP)] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Envelope[UserPage]:
    """The accounts of the organization by e-mail."""
    page, count = await services.database.run(people_of, admin.organization_id, skip, limit)
    return Envelope(resultData=UserPage(data=[user_dto(person) for person in page], count=count))


@router.post("")
async def create_user(new: NewUser, request: Request, admin: AdminDep, services: ServicesDep) -> Envelope[CreatedUser]:
    """A new account in the administrator's organization; 409 if the e-mail is taken."""
    membership = Membership(admin.organization_id, new.is_organization_admin)
    made = None if new.password else new_password()
    password = await hashed_for(request, services, admin.id, new.password or made or "")
    try:
        person = await services.database.run(
            add_member, new.email, password, new.full_name, membership, new.is_program, actor_of(admin)
        )
    except AccountExists as error:
        raise ApiError(ResultCode.USER_ALREADY_EXISTS, "this e-mail has an account already", status=409) from error
    return Envelope(resultData=CreatedUser(message="account created", id=person.id, password=made))


@router.put("/{account_id}")
async def change_user(account_id: str, change: UserChange, admin: AdminDep, services: ServicesDep) -> Envelope[UserDto]:
    """Disable, enable, mark as a program or as an administrator; never the own account (403 ``auth.own_account``)."""
    person = await _other(services, admin, account_id)
    wanted = MemberChange(change.is_active, change.is_program, change.is_organization_admin)
    with role_changes():
        changed = await services.database.run(change_member, person.id, wanted, actor_of(admin))
    await services.revoke()
    return Envelope(resultData=user_dto(changed))


@router.delete("/{account_id}")
async def remove_user(account_id: str, admin: AdminDep, services: ServicesDep) -> Envelope[DoneMessage]:
    """The account, its grants and its connections; never the own account."""
    person = await _other(services, admin, account_id)
    with role_changes():
        await services.database.run(remove_member, person.id, actor_of(admin))
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="account removed"))


async def member_of(services: Services, admin: Person, account_id: str) -> Person:
    """An account of the administrator's organization."""
    person = await services.database.run(person_by_id, account_id.lower()) if is_uuid(account_id) else None
    if person is None or person.organization_id != admin.organization_id:
        raise unknown_account()
    return person


async def _other(services: Services, admin: Person, account_id: str) -> Person:
    """One that isn't the administrator's own."""
    person = await member_of(services, admin, account_id)
    if person.id == admin.id:
        raise own_account()
    return person
