"""Every check of a password goes through here, so that all of them count against the limits of guessing."""

from __future__ import annotations

import logging
import math
import time

from fastapi import Request

from mosaic_core.words.codes import ResultCode
from mosaic_server.rest.envelope import ApiError
from mosaic_server.security.address_prefix import counted_address
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Person, note_failed_login, person_by_password

_log = logging.getLogger(__name__)


async def person_with_password(
    services: Services, request: Request, email: str, password: str, organization_name: str | None = None
) -> Person | None:
    """Whose password it is, or ``None``; 429 after several wrong ones. ``email`` is normalised.

    ``organization_name``: the account must belong to it, if it is given; a wrong one counts like a wrong password, so
    that nobody finds out by it who is where.
    """
    address = address_of(request)
    must_not_guess_on(services, email, address)
    async with services.hashing.turn(counted_address(address)):
        # again: attempts that wait side by side must see each other's failures
        must_not_guess_on(services, email, address)
        person = await services.database.run(person_by_password, email, password, organization_name)
        if person is None:
            services.login_limits.failed(email, address, time.monotonic())
    if person is None:
        _log.warning("a password from %s was wrong", address)
        await services.database.run(note_failed_login, email, address, "wrong password")
    else:
        services.login_limits.succeeded(email, address, time.monotonic())
    return person


def must_not_guess_on(services: Services, email: str | None, address: str) -> None:
    """Raises the 429 of an e-mail or address that failed too often."""
    wait_s = services.login_limits.wait_s(email, address, time.monotonic())
    if wait_s > 0:
        raise ApiError(
            ResultCode.AUTHENTICATION_FAILED,
            f"too many failed attempts; try again in {math.ceil(wait_s)} s",
            status=429,
            cure="Wait that long; whoever forgot the password asks an administrator of the server for a new one.",
            headers={"Retry-After": str(math.ceil(wait_s))},
        )


def address_of(request: Request) -> str:
    return request.client.host if request.client else ""
