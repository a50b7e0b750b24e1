"""Answers a refused change of roles or accounts, wherever it was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mosaic_core.words.codes import ResultCode
from mosaic_server.rest.envelope import ApiError, Failure
from mosaic_server.storage.grants import LastAdministrator, LastSupervisor, OwnAccount, UnknownAccount

CHANGES: dict[int | str, dict[str, Any]] = {404: {"model": Failure}, 409: {"model": Failure}}
"""What routes about roles and accounts answer beside the errors of all routes, for OpenAPI."""


@contextmanager
def role_changes() -> Iterator[None]:
    """Turns what the storage raises into answers."""
    try:
        yield
    except LastSupervisor as error:
        message = f"robot {str(error)!r} would be left without a supervisor"
        raise ApiError(ResultCode.ACCESS_DENIED, message, code="auth.last_supervisor", status=409) from error
    except LastAdministrator as error:
        raise ApiError(ResultCode.ACCESS_DENIED, code="auth.last_admin", status=409) from error
    except OwnAccount as error:
        raise own_account() from error
    except UnknownAccount as error:
        raise unknown_account() from error


def unknown_account() -> ApiError:
    return ApiError(ResultCode.USER_NOT_FOUND, "no such account in the organization", code="auth.unknown_account")


def own_account() -> ApiError:
    return ApiError(ResultCode.ACCESS_DENIED, code="auth.own_account")
