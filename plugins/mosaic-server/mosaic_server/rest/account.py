"""Logging in, signing up, one-time codes."""

from __future__ import annotations

import time

from fastapi import APIRouter, Request
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import ApiError, DoneMessage, Envelope
from mosaic_server.rest.hashing import hashed_for
from mosaic_server.rest.password_attempts import address_of, must_not_guess_on, person_with_password
from mosaic_server.rest.signed_in import PersonDep, ServicesDep
from mosaic_server.rest.texts import EMAIL, NAME, NO_NUL
from mosaic_server.security.address_prefix import counted_address
from mosaic_server.security.one_time_codes import LIFETIME_S, OneTimeLogin
from mosaic_server.security.passwords import MAX_PASSWORD_LENGTH, MIN_PASSWORD_LENGTH
from mosaic_server.services import Services
from mosaic_server.storage.accounts import (
    AccountExists,
    Person,
    add_account,
    normalised_email,
    note_failed_login,
    person_by_id,
)

router = APIRouter(prefix="/api/v1/account", tags=["account"])
WRONG_PASSWORD_CURE = "Check what was typed; an administrator of the server can set a new password."  # noqa: S105
ASK_FOR_A_NEW_CODE = "Sign in with e-mail and password, or ask for a new code."


class Login(WireModel):
    """What an account logs in with. ``username`` is the e-mail."""

    username: str = Field(max_length=254, pattern=NO_NUL)
    password: str = Field(max_length=MAX_PASSWORD_LENGTH, repr=False)


class OrganizationLogin(Login):
    """What an account of an organization logs in with. ``organizationName`` is the name of the organization; one of a
    single person is named by their e-mail.
    """

    organization_name: str = Field(max_length=254, pattern=NO_NUL)


class AccessToken(WireModel):
    access_token: str = Field(repr=False)
    existing_connection: bool = False


class OneTimeCode(WireModel):
    code: str = Field(max_length=200, repr=False)


class IssuedCode(OneTimeCode):
    expires_in_s: float = Field(description="For so long it signs in, unless it did.")


class Signup(WireModel):
    email: str = Field(max_length=254, pattern=EMAIL)
    password: str = Field(min_length=MIN_PASSWORD_LENGTH, max_length=MAX_PASSWORD_LENGTH, repr=False)
    full_name: str = Field(default="", max_length=200, pattern=NAME)


@router.post("/login/access-token")
async def log_in(login: Login, request: Request, services: ServicesDep) -> Envelope[AccessToken]:
    """Public. 429 after several wrong passwords."""
    person = await person_with_password(services, request, normalised_email(login.username), login.password)
    if person is None:
        raise ApiError(ResultCode.INVALID_PASSWORD, "e-mail or password is wrong", status=401, cure=WRONG_PASSWORD_CURE)
    return await _access(services, person, request)


@router.post("/login/organization/access-token")
async def log_in_to_organization(
    login: OrganizationLogin, request: Request, services: ServicesDep
) -> Envelope[AccessToken]:
    """Public; the log-in of original dashboards for members. 429 after several wrong attempts, as above."""
    email, name = normalised_email(login.username), login.organization_name
    person = await person_with_password(services, request, email, login.password, name)
    if person is None:
        message = "organization, e-mail or password is wrong"
        raise ApiError(ResultCode.INVALID_PASSWORD, message, status=401, cure=WRONG_PASSWORD_CURE)
    return await _access(services, person, request)


@router.post("/login/one-time")
async def log_in_with_code(code: OneTimeCode, request: Request, services: ServicesDep) -> Envelope[AccessToken]:
    """Public. A code works once, for a minute."""
    address = address_of(request)
    must_not_guess_on(services, None, address)
    login = services.codes.redeem(code.code, time.monotonic())
    person = None if login is None else await services.database.run(person_by_id, login.account_id)
    if login is None or person is None or person.login_version != login.login_version:
        services.login_limits.failed(None, address, time.monotonic())
        await services.database.run(note_failed_login, None, address, "wrong sign-in code")
        message = "this sign-in code is wrong, was used already, or is too old"
        raise ApiError(ResultCode.AUTHENTICATION_FAILED, message, cure=ASK_FOR_A_NEW_CODE)
    return await _access(services, person, request)


@router.post("/one-time-code")
async def issue_code(person: PersonDep, services: ServicesDep) -> Envelope[IssuedCode]:
    """A code that signs this account in somewhere else, once and within a minute: put it behind ``/#code=``, or give it
    to ``--code``."""
    login = OneTimeLogin(person.id, person.login_version)
    code = services.codes.issue(login, time.monotonic())
    return Envelope(resultData=IssuedCode(code=code, expires_in_s=LIFETIME_S))


@router.post("/signup")
async def sign_up(signup: Signup, request: Request, services: ServicesDep) -> Envelope[DoneMessage]:
    """Public; 403 unless the server was started with ``--allow-signup``."""
    if not services.settings.allow_signup:
        raise ApiError(ResultCode.ACCESS_DENIED, "this server takes no sign-ups; ask its administrator")
    try:
        password = await hashed_for(request, services, counted_address(address_of(request)), signup.password)
        await services.database.run(add_account, signup.email, password, signup.full_name)
    except AccountExists as error:
        raise ApiError(ResultCode.USER_ALREADY_EXISTS, "this e-mail has an account already", status=409) from error
    return Envelope(resultData=DoneMessage(message="signed up"))


@router.post("/disconnect")
async def disconnect(_: PersonDep) -> Envelope[DoneMessage]:
    """Known to original dashboards; has no effect there either."""
    return Envelope(resultData=DoneMessage(message="disconnected"))


async def _access(services: Services, person: Person, request: Request) -> Envelope[AccessToken]:
    if not person.is_active:
        await services.database.run(note_failed_login, person.email, address_of(request), "the account is disabled")
        raise ApiError(ResultCode.USER_NOT_ACTIVE, "this account is disabled", status=403)
    token = services.access_tokens.make(person.id, person.organization_id, _role(person), person.login_version)
    return Envelope(resultData=AccessToken(access_token=token))


def _role(person: Person) -> str:
    return "ROLE_ORGANIZATION_ADMIN" if person.is_organization_admin else "ROLE_USER"
