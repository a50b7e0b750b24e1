"""Every check of a password goes through here, so that all of them count against the limits of guessing."""

from __future__ import annotations

import logging
import math
import time
from functools import partial

from fastapi import Request

from mosaic_core.words.codes import ResultCode
from mosaic_server.rest.envelope import ApiError
from mosaic_server.rest.hashing import hashing_turn
from mosaic_server.security.address_prefix import counted_address
from mosaic_server.security.passwords import HashedPassword, check_password
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Claimed, Person, claimed, note_failed_login, renew_hash

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
    async with hashing_turn(request, services, counted_address(address)) as hashing:
        # again: attempts that wait side by side must see each other's failures
        must_not_guess_on(services, email, address)
        wanted = await services.database.run(claimed, email, organization_name)
        person = await _person(services, wanted, await hashing(partial(_checked, wanted, password)))
        if person is None:
            services.login_limits.failed(email, address, time.monotonic())
    if person is None:
        _log.warning("a password from %s was wrong", address)
        await services.database.run(note_failed_login, email, address, "wrong password")
    else:
        services.login_limits.succeeded(email, address, time.monotonic())
    return person


def _checked(wanted: Claimed | None, password: str) -> HashedPassword | None:
    """The hash to keep from now on. It takes as long for an unknown e-mail as for a known one."""
    fresh = check_password(None if wanted is None else wanted.password.text, password)
    return None if fresh is None else HashedPassword(fresh)


async def _person(services: Services, wanted: Claimed | None, fresh: HashedPassword | None) -> Person | None:
    if wanted is None or fresh is None or not wanted.is_in_organization:
        return None
    if fresh != wanted.password:
        await services.database.run(renew_hash, wanted, fresh)
    return wanted.person


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
