"""Pairing a device with the robot that runs this server: a PIN or a scanned code against a sign-in that lasts."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BeforeValidator, Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import ApiError, DoneMessage, Envelope
from mosaic_server.rest.password_attempts import address_of, must_not_guess_on
from mosaic_server.rest.signed_in import PersonDep, ServicesDep, actor_of
from mosaic_server.rest.texts import NAME, NO_NUL
from mosaic_server.roles import Role
from mosaic_server.security.pairing import Offer, PairingVerdict, typed_pin, with_code, with_pin
from mosaic_server.services import Services
from mosaic_server.storage.accounts import note_failed_login
from mosaic_server.storage.devices import is_device, pair, revoke_device

_log = logging.getLogger(__name__)
router = APIRouter(prefix="/api/v1/pairing", tags=["pairing"])


def _quoted(value: object) -> object:
    """A PIN that was written as a number has lost the zeros it began with."""
    if isinstance(value, int):
        raise ValueError('write it as text, in quotes: "012345"; a number has no zeros at its beginning')
    return value


Secret = Annotated[str, BeforeValidator(_quoted), Field(min_length=1, max_length=64, pattern=NO_NUL)]


class Pairing(WireModel):
    """Either ``pin`` or ``code``. ``name``: what people call the device."""

    pin: Secret | None = Field(default=None, repr=False)
    code: Secret | None = Field(default=None, repr=False)
    name: str = Field(default="", max_length=60, pattern=NAME)


class Paired(WireModel):
    """A device was paired. ``accessToken`` counts until the device is revoked."""

    access_token: str = Field(repr=False)
    role: Role
    robot_id: str
    robot_name: str


class ProofWanted(WireModel):
    """A device that asks for proof. ``claims``: the first two parts of an access token, without the third, which makes
    it one.
    """

    claims: str = Field(max_length=4096, pattern=r"^[\w-]+\.[\w-]+$")
    nonce: str = Field(min_length=16, max_length=64, pattern=r"^[\w-]+$")


class Proof(WireModel):
    """What nobody can answer but the server that made the token."""

    proof: str


@router.post("")
async def pair_device(wanted: Pairing, request: Request, services: ServicesDep) -> Envelope[Paired]:
    """Public. 401 ``auth.pairing`` for what is wrong, used or too old; 429 after several wrong PINs; 404 on a server
    that belongs to no robot."""
    if services.settings.pairs_with is None:
        raise ApiError(ResultCode.ACCESS_DENIED, "nothing is paired here", code="auth.forbidden", status=404)
    if (wanted.pin is None) == (wanted.code is None):
        raise ApiError(ResultCode.INVALID_FORMAT, "either a PIN or a code")
    address = address_of(request)
    async with services.pairing:
        _must_not_try_on(services, wanted, address)
        paired = await services.database.run(pair, _judge(wanted), wanted.name.strip() or "device", address)
        if isinstance(paired, PairingVerdict):
            raise await _refusal(services, wanted, address, paired.tries_left)
    person = paired.person
    _log.info("paired %r as %s, from %s", person.full_name, paired.role, address)
    make = services.access_tokens.make
    token = make(person.id, person.organization_id, "ROLE_USER", person.login_version, until_revoked=True)
    return Envelope(
        resultData=Paired(access_token=token, role=paired.role, robot_id=paired.robot_id, robot_name=paired.robot_name)
    )


@router.post("/proof")
async def prove(wanted: ProofWanted, services: ServicesDep) -> Envelope[Proof]:
    """Public: before a device shows its sign-in it asks whether this is the server that gave it."""
    return Envelope(resultData=Proof(proof=services.access_tokens.proof(wanted.claims, wanted.nonce)))


@router.delete("")
async def unpair(person: PersonDep, services: ServicesDep) -> Envelope[DoneMessage]:
    """The paired device that asks is signed out for good, and its connections end; 403 for any other account."""
    if not await services.database.run(is_device, person.id):
        raise ApiError(ResultCode.ACCESS_DENIED, "this account is no paired device")
    await services.database.run(revoke_device, person.id, actor_of(person))
    await services.revoke()
    return Envelope(resultData=DoneMessage(message="unpaired"))


def _judge(wanted: Pairing) -> Callable[[Sequence[Offer]], PairingVerdict]:
    if wanted.pin is not None:
        return partial(with_pin, pin=typed_pin(wanted.pin))
    return partial(with_code, code=wanted.code or "")


def _must_not_try_on(services: Services, wanted: Pairing, address: str) -> None:
    must_not_guess_on(services, None, address)
    wait_s = services.pin_limits.wait_s(time.monotonic()) if wanted.pin else 0.0
    if wait_s > 0:
        raise ApiError(
            ResultCode.AUTHENTICATION_FAILED,
            f"too many wrong PINs; scan the QR code, or try again in {math.ceil(wait_s / 60)} min",
            code="auth.pairing_locked",
            status=429,
            headers={"Retry-After": str(math.ceil(wait_s))},
        )


async def _refusal(services: Services, wanted: Pairing, address: str, tries_left: int) -> ApiError:
    now_s = time.monotonic()
    services.login_limits.failed(None, address, now_s)
    if wanted.pin:
        services.pin_limits.failed(now_s)
    what = "PIN" if wanted.pin else "pairing code"
    _log.warning("a %s from %s was wrong", what, address)
    await services.database.run(note_failed_login, None, address, f"wrong {what}")
    message = f"this PIN is wrong or too old; {tries_left} more may be tried" if wanted.pin else None
    return ApiError(ResultCode.AUTHENTICATION_FAILED, message, code="auth.pairing", status=401)
