"""The account that is logged in."""

from __future__ import annotations

from fastapi import APIRouter, Request
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import ApiError, DoneMessage, Envelope, iso_time
from mosaic_server.rest.hashing import hashed_for
from mosaic_server.rest.password_attempts import person_with_password
from mosaic_server.rest.signed_in import PersonDep, ServicesDep
from mosaic_server.rest.texts import NAME
from mosaic_server.security.passwords import MAX_PASSWORD_LENGTH, MIN_PASSWORD_LENGTH
from mosaic_server.storage.accounts import Person, change_full_name, change_password

router = APIRouter(prefix="/api/v1/users", tags=["users"])


class UserDto(WireModel):
    """An account, as administrators see it. ``isProgram`` is ours: the account is a program's and never passes for a
    person on a robot.
    """

    id: str
    email: str
    is_active: bool
    is_organization_admin: bool
    is_program: bool
    full_name: str
    created_at: str
    updated_at: str


class FullName(WireModel):
    full_name: str = Field(max_length=200, pattern=NAME)


class PasswordChange(WireModel):
    current_password: str = Field(max_length=MAX_PASSWORD_LENGTH, repr=False)
    new_password: str = Field(min_length=MIN_PASSWORD_LENGTH, max_length=MAX_PASSWORD_LENGTH, repr=False)


@router.get("/me")
async def me(person: PersonDep) -> Envelope[UserDto]:
    return Envelope(resultData=user_dto(person))


@router.put("/me")
async def rename_me(change: FullName, person: PersonDep, services: ServicesDep) -> Envelope[DoneMessage]:
    await services.database.run(change_full_name, person.id, change.full_name)
    return Envelope(resultData=DoneMessage(message="saved"))


@router.put("/me/password")
async def change_my_password(
    change: PasswordChange, request: Request, person: PersonDep, services: ServicesDep
) -> Envelope[DoneMessage]:
    """Ends every log-in of the account, this one included."""
    if await person_with_password(services, request, person.email, change.current_password) is None:
        raise ApiError(ResultCode.INVALID_PASSWORD, "the current password is wrong")
    password = await hashed_for(request, services, person.id, change.new_password)
    await services.database.run(change_password, person.id, password)
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="password changed; log in again"))


def user_dto(person: Person) -> UserDto:
    return UserDto(
        id=person.id,
        email=person.email,
        is_active=person.is_active,
        is_organization_admin=person.is_organization_admin,
        is_program=person.is_program,
        full_name=person.full_name,
        created_at=iso_time(person.created_at_ms),
        updated_at=iso_time(person.updated_at_ms),
    )
