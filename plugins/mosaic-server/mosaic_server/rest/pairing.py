"""Pairing a device with the robot that runs this server: a PIN or a scanned code against a sign-in that lasts."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import ApiError, Envelope
from mosaic_server.rest.password_attempts import address_of, must_not_guess_on
from mosaic_server.rest.signed_in import ServicesDep
from mosaic_server.rest.texts import NAME, NO_NUL
from mosaic_server.roles import Role
from mosaic_server.security.pairing import Offer, Verdict, typed_pin, with_code, with_pin
from mosaic_server.services import Services
from mosaic_server.storage.accounts import note_failed_login
from mosaic_server.storage.devices import pair

_log = logging.getLogger(__name__)
router = APIRouter(prefix="/api/v1/pairing", tags=["pairing"])
Secret = Annotated[str, Field(min_length=1, max_length=64, pattern=NO_NUL)]


class Pairing(WireModel):
    """Either ``pin`` or ``code``. ``name``: what people call the device."""

    pin: Secret | None = Field(default=None, repr=False)
    code: Secret | None = Field(default=None, repr=False)
    name: str = Field(default="", max_length=60, pattern=NAME)


class Paired(WireModel):
    """``accessToken`` counts until the device is revoked."""

    access_token: str = Field(repr=False)
    role: Role


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
        if paired is None:
            await _refuse(services, wanted, address)
    assert paired is not None
    person, role = paired
    _log.info("paired %r as %s, from %s", person.full_name, role, address)
    make = services.access_tokens.make
    token = make(person.id, person.organization_id, "ROLE_USER", person.login_version, until_revoked=True)
    return Envelope(resultData=Paired(access_token=token, role=role))


def _judge(wanted: Pairing) -> Callable[[Sequence[Offer]], Verdict]:
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
            code="auth.pairing",
            status=429,
            headers={"Retry-After": str(math.ceil(wait_s))},
        )


async def _refuse(services: Services, wanted: Pairing, address: str) -> None:
    now_s = time.monotonic()
    services.login_limits.failed(None, address, now_s)
    if wanted.pin:
        services.pin_limits.failed(now_s)
    what = "PIN" if wanted.pin else "pairing code"
    _log.warning("a %s from %s was wrong", what, address)
    await services.database.run(note_failed_login, None, address, f"wrong {what}")
    raise ApiError(ResultCode.AUTHENTICATION_FAILED, code="auth.pairing", status=401)
