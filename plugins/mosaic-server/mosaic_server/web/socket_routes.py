"""The drivers of ``/ws/robot`` and ``/ws/user``: bytes in, events to the switchboard."""

from __future__ import annotations

import logging
import time

from fastapi import APIRouter
from sqlalchemy.exc import SQLAlchemyError
from starlette.websockets import WebSocket

from mosaic_core.words.codes import CloseCode
from mosaic_core.words.signaling import Authorize, ErrorEcho, MalformedSignaling, parse_spelled
from mosaic_server.services import Services, services_of
from mosaic_server.sockets.link import LINK, Link
from mosaic_server.switchboard.events import MalformedArrived, MessageArrived, RobotAuthorized, Side
from mosaic_server.web.origins import origin_is_allowed

_log = logging.getLogger(__name__)

router = APIRouter()


@router.websocket("/ws/robot")
async def robot_socket(websocket: WebSocket) -> None:
    await _serve(websocket, Side.ROBOT)


@router.websocket("/ws/user")
async def operator_socket(websocket: WebSocket) -> None:
    await _serve(websocket, Side.OPERATOR)


async def _serve(websocket: WebSocket, side: Side) -> None:
    services = services_of(websocket)
    if not origin_is_allowed(websocket.headers, services.settings.allowed_origins):
        _log.warning("refused a socket from origin %r; allow it with --allow-origin", websocket.headers.get("origin"))
        await websocket.close(CloseCode.FORBIDDEN)
        return
    link: Link = websocket.scope["extensions"][LINK]
    await websocket.accept()
    number = services.exchange.open(link, side)
    try:
        await _read(websocket, services, number, side)
    finally:
        services.authorizer.forget(number)
        services.exchange.closed(number, said_goodbye=link.said_goodbye)


async def _read(websocket: WebSocket, services: Services, number: int, side: Side) -> None:
    """One message at a time, so that the order of a socket's messages is kept. The link counts them."""
    while True:
        frame = await websocket.receive()
        if frame["type"] == "websocket.disconnect":
            return
        text: str | None = frame.get("text")
        if text is None:
            services.exchange.handle(MalformedArrived(number, None, time.monotonic()))
        else:
            await _take(services, number, side, text)


async def _take(services: Services, number: int, side: Side, text: str) -> None:
    exchange = services.exchange
    try:
        read = parse_spelled(text)
    except MalformedSignaling as error:
        _log.debug("socket %d: %s", number, error)
        exchange.handle(MalformedArrived(number, error.spelled, time.monotonic()))
        return
    if isinstance(read.message, ErrorEcho) and read.message.request_type == Authorize.type:
        exchange.handle(MalformedArrived(number, Authorize.type, time.monotonic()))  # a number is no log-in
    elif isinstance(read.message, Authorize):
        decided = await services.authorizer.check(number, side, read.message)
        exchange.handle(decided)
        if isinstance(decided, RobotAuthorized):
            await _tell_what_is_over(services, decided.robot_id)
    else:
        exchange.handle(MessageArrived(number, read.message, read.spelled, time.monotonic()))


async def _tell_what_is_over(services: Services, robot_id: str) -> None:
    """While it was away roles may have changed; should the database not answer, the regular check says it."""
    try:
        await services.close_void_connections(robot_id)
    except SQLAlchemyError:
        _log.exception("robot %s could not be told which connections are over", robot_id)
