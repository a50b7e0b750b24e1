"""The dependency of every route that isn't public: who is asking."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from mosaic_core.words.codes import ResultCode
from mosaic_server.rest.envelope import ApiError
from mosaic_server.security.access_tokens import AccessTokenRefused
from mosaic_server.services import Services, services_of
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.grants import Actor, operates_anything

_bearer = HTTPBearer(auto_error=False)


def _services(request: Request) -> Services:
    return services_of(request)


ServicesDep = Annotated[Services, Depends(_services)]


async def _person(
    services: ServicesDep, credentials: Annotated[HTTPAuthorizationCredentials | None, Depends(_bearer)]
) -> Person:
    if credentials is None:
        raise ApiError(ResultCode.AUTHENTICATION_FAILED, code="auth.required", headers={"WWW-Authenticate": "Bearer"})
    try:
        person, _ = await services.authorizer.person_of(credentials.credentials)
    except AccessTokenRefused as error:
        raise ApiError(error.code, headers={"WWW-Authenticate": "Bearer"}) from error
    return person


PersonDep = Annotated[Person, Depends(_person)]


async def _admin(person: PersonDep) -> Person:
    if not person.is_organization_admin:
        raise ApiError(ResultCode.ACCESS_DENIED, "only an administrator of the organization may do this")
    return person


AdminDep = Annotated[Person, Depends(_admin)]
"""The account that is logged in, an administrator of its organization."""


async def _operator(person: PersonDep, services: ServicesDep) -> Person:
    if not await services.database.run(operates_anything, person.id):
        raise ApiError(ResultCode.ACCESS_DENIED, "accounts that may only observe change nothing here")
    return person


OperatorDep = Annotated[Person, Depends(_operator)]
"""The account that is logged in, which may operate at least one robot of its organization."""


def actor_of(person: Person) -> Actor:
    """Who did it, for the audit log and for the rule that nobody raises the own role."""
    return Actor(person.email, person.id)
