"""The envelope of every answer: ``{"resultCode": 100, "resultData": …}``, or the name of what went wrong."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from typing import Any, Generic, TypeVar
from urllib.parse import quote

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from mosaic_core.words.codes import RESULT_REASONS, ResultCode, reason
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.hashing import ClientGone
from mosaic_server.rest.missed_route import missed_route
from mosaic_server.security.hashing_line import LineTooLong

T = TypeVar("T")
_log = logging.getLogger(__name__)

MAX_SKIP = 2**31 - 1
"""Of pages; larger numbers fit into no database's integer."""

HTTP_STATUS: dict[ResultCode, int] = {
    ResultCode.ACCESS_TOKEN_DECRYPTING_FAILED: 401,
    ResultCode.ACCESS_TOKEN_EXPIRED: 401,
    ResultCode.ACCESS_TOKEN_NOT_EXIST: 401,
    ResultCode.UNKNOWN_EXCEPTION_OCCURRED: 500,
    ResultCode.ACCESS_DENIED: 403,
    ResultCode.AUTHENTICATION_FAILED: 401,
    ResultCode.USER_NOT_FOUND: 404,
    ResultCode.ROBOT_NOT_FOUND: 404,
    ResultCode.CANNOT_DELETE_YOURSELF: 403,
    ResultCode.OCCUPANCY_MAP_NOT_FOUND: 404,
}
"""Everything else is 400. Bad tokens are 401, so that a browser knows it has to log in again."""


class Envelope(BaseModel, Generic[T]):
    """A success."""

    resultCode: int = ResultCode.SUCCESS
    resultData: T


class Failure(BaseModel):
    """A failure: the original's name of it, our reason code, and words for people."""

    resultCode: str
    resultData: None = None
    code: str
    message: str
    cure: str = ""


class DoneMessage(WireModel):
    """The message with which the original answers a change."""

    message: str


class Created(DoneMessage):
    id: str


class ApiError(Exception):
    """Raise it in a route; it becomes a :class:`Failure`."""

    def __init__(
        self,
        result: ResultCode,
        message: str | None = None,
        *,
        code: str | None = None,
        status: int | None = None,
        headers: dict[str, str] | None = None,
        name: str | None = None,
        cure: str | None = None,
    ) -> None:
        """``name``: the original's, where two of them share a number; ``cure``: better than the code's own."""
        super().__init__(message or result.name)
        self.name = name or result.name
        self.code = code or _code_of(result)
        self.message = message or reason(self.code).sentence
        self.status = status or HTTP_STATUS.get(result, 400)
        self.headers = headers
        self.cure = cure


def _code_of(result: ResultCode) -> str:
    """What can't be understood here is a request, and no version of either side mends it."""
    return "rest.bad_request" if result is ResultCode.INVALID_FORMAT else RESULT_REASONS.get(result, "rest.bad_request")


def failure(name: str, code: str, message: str, cure: str | None = None) -> dict[str, Any]:
    """``name``: of a :class:`ResultCode`."""
    return Failure(resultCode=name, code=code, message=message, cure=cure or reason(code).cure).model_dump()


def install_error_handlers(app: FastAPI) -> None:
    """Every error leaves in the envelope."""

    @app.exception_handler(ApiError)
    async def _api_error(_: Request, error: ApiError) -> JSONResponse:
        return JSONResponse(failure(error.name, error.code, error.message, error.cure), error.status, error.headers)

    @app.exception_handler(LineTooLong)
    async def _line_too_long(_: Request, line: LineTooLong) -> JSONResponse:
        whose = " from this address" if line.is_of_address else ""
        message = f"too many log-ins{whose} wait to be checked already; try again in {line.retry_after_s} s"
        words = failure(ResultCode.AUTHENTICATION_FAILED.name, "rest.bad_request", message, "Wait that long.")
        return JSONResponse(words, 429 if line.is_of_address else 503, {"Retry-After": str(line.retry_after_s)})

    @app.exception_handler(ClientGone)
    async def _client_gone(_: Request, __: ClientGone) -> Response:
        return Response(status_code=499)  # for the log alone: nginx's number of a client that closed the request

    @app.exception_handler(RequestValidationError)
    async def _invalid(_: Request, error: RequestValidationError) -> JSONResponse:
        problems = "; ".join(f"{_place(problem['loc'])}: {problem['msg']}" for problem in error.errors()[:10])
        return JSONResponse(failure(ResultCode.INVALID_FORMAT.name, "rest.bad_request", problems), 400)

    @app.exception_handler(HTTPException)
    async def _http(request: Request, error: HTTPException) -> JSONResponse:
        if error.status_code not in (404, 405):
            words = failure(ResultCode.INVALID_FORMAT.name, "rest.bad_request", str(error.detail))
            return JSONResponse(words, error.status_code, error.headers)
        missed = missed_route(app.openapi()["paths"], request.method, request.url.path)
        words = failure(ResultCode.INVALID_FORMAT.name, missed.code, missed.message)
        return JSONResponse(words, missed.status, missed.headers)

    @app.exception_handler(Exception)
    async def _unexpected(request: Request, error: Exception) -> JSONResponse:
        _log.error("%s %s failed", request.method, quote(request.scope["path"]), exc_info=error)
        words = failure(ResultCode.UNKNOWN_EXCEPTION_OCCURRED.name, "rest.server_mistake", "the server made a mistake")
        return JSONResponse(words, 500)


def _place(location: tuple[int | str, ...]) -> str:
    """``body.robotIds.0``, without the value: it may be a password."""
    return ".".join(str(part) for part in location)


def iso_time(ms: int) -> str:
    return datetime.fromtimestamp(ms / 1000, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
