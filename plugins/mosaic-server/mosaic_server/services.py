"""Everything that a running server consists of, made in one place."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from pydantic import ValidationError
from starlette.requests import HTTPConnection

from mosaic_core.words.catalogue import Catalogue
from mosaic_server.security.access_tokens import AccessTokens
from mosaic_server.security.hashing_line import HashingLine
from mosaic_server.security.login_limits import LoginLimits
from mosaic_server.security.one_time_codes import OneTimeCodes
from mosaic_server.security.pairing import PinLimits
from mosaic_server.security.passwords import hash_at
from mosaic_server.security.tickets import TicketOffice
from mosaic_server.settings import Settings
from mosaic_server.sockets.authorizer import Authorizer
from mosaic_server.sockets.catalogue_keeper import CatalogueKeeper
from mosaic_server.sockets.exchange import Exchange
from mosaic_server.storage.audit import prune_audit
from mosaic_server.storage.database import Database
from mosaic_server.storage.issued_tickets import forget_tickets, void_tickets
from mosaic_server.storage.keys import access_token_secret, ticket_key
from mosaic_server.storage.robots import RobotRecord, all_robots
from mosaic_server.switchboard import Switchboard
from mosaic_server.switchboard.events import ConnectionsVoid, RobotRemembered
from mosaic_server.widget_shelf import WidgetShelf, installed_widgets

_log = logging.getLogger(__name__)

PRUNE_S = 3600.0


@dataclass(slots=True)
class Services:
    """The parts, for routes and sockets to use. Event-loop thread only."""

    settings: Settings
    database: Database
    access_tokens: AccessTokens
    tickets: TicketOffice
    authorizer: Authorizer
    exchange: Exchange
    catalogues: CatalogueKeeper
    widgets: WidgetShelf
    codes: OneTimeCodes = field(default_factory=OneTimeCodes)
    login_limits: LoginLimits = field(default_factory=LoginLimits)
    pin_limits: PinLimits = field(default_factory=PinLimits)
    pairing: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Attempts to pair that come side by side must see each other's failures."""
    hashing: HashingLine = field(default_factory=HashingLine)

    async def tick(self) -> None:
        self.exchange.tick()

    async def revoke(self) -> None:
        """Close every socket and connection that no longer holds; call after changing accounts, roles or tokens."""
        for socket, code in await self.authorizer.revoked():
            self.exchange.condemn(socket, code)
        await self.close_void_connections()

    async def close_void_connections(self, robot_id: str | None = None) -> None:
        """Connections whose role was changed meanwhile; of one robot that just came, or of all."""
        await self.forget_what_is_over()
        void = await self.database.run(void_tickets, robot_id)
        for one in {ticket.robot_id for ticket in void}:
            mine = [ticket for ticket in void if ticket.robot_id == one]
            codes = {ticket.connection_id: ticket.code for ticket in mine}
            newest = next((ticket.connection_id for ticket in mine if ticket.is_newest), None)
            self.exchange.handle(ConnectionsVoid(one, codes, time.monotonic(), newest))

    async def forget_what_is_over(self) -> None:
        """Tickets of connections that their robots know are over. One that a robot refused must not take the place of
        a living one of the same session."""
        heard = self.exchange.switchboard.heard_by_robots(time.monotonic())
        if heard:
            await self.database.run(forget_tickets, heard)

    async def prune(self) -> None:
        await self.database.run(prune_audit, self.settings.audit_days)


def services_of(connection: HTTPConnection) -> Services:
    services = connection.app.state.services
    assert isinstance(services, Services)
    return services


@asynccontextmanager
async def running(settings: Settings) -> AsyncIterator[Services]:
    """Open the database, remember its robots, keep time; everything ends with the block."""
    hash_at(settings.hashing)
    database = Database(settings.data_dir, settings.database_url)
    try:
        database.lock()
        await asyncio.to_thread(database.migrate)
        services = await _built(settings, database)
        await services.prune()
        clockwork = [
            asyncio.create_task(_every(settings.keep_alive.check_s, "keep-alive", services.tick)),
            # the command line may change accounts and tokens beside the running server
            asyncio.create_task(_every(settings.revocation_check_s, "the check for revocations", services.revoke)),
            asyncio.create_task(_every(PRUNE_S, "pruning the audit log", services.prune)),
        ]
        try:
            yield services
        finally:
            for task in clockwork:
                task.cancel()
            await asyncio.gather(*clockwork, return_exceptions=True)
            await services.catalogues.drain()
            services.hashing.close()
    finally:
        database.close()


async def _built(settings: Settings, database: Database) -> Services:
    access_tokens = AccessTokens(await database.run(access_token_secret))
    tickets = TicketOffice(await database.run(ticket_key))
    board = Switchboard(keys=(tickets.public_key,), authorize_within_s=settings.authorize_within_s)
    for robot in await database.run(all_robots):
        board.handle(RobotRemembered(robot.id, robot.organization_id, _catalogue(robot)))
    keeper = CatalogueKeeper(database)
    exchange = Exchange(board, lambda kept: keeper.keep(kept.robot_id, kept.catalogue), settings.keep_alive)
    return Services(
        settings=settings,
        database=database,
        access_tokens=access_tokens,
        tickets=tickets,
        authorizer=Authorizer(database, access_tokens, settings.turn_lifetime_s),
        exchange=exchange,
        catalogues=keeper,
        widgets=await asyncio.to_thread(installed_widgets, is_open=settings.serves_widgets),
    )


def _catalogue(robot: RobotRecord) -> Catalogue | None:
    if robot.catalogue is None:
        return None
    with contextlib.suppress(ValidationError):
        return Catalogue.model_validate_json(robot.catalogue)
    return None  # written by another version; the robot announces it again when it connects


async def _every(period_s: float, name: str, step: Callable[[], Awaitable[None]]) -> None:
    """Repeat for ever; a step that fails is logged once and tried again."""
    is_failing = False
    while True:
        await asyncio.sleep(period_s)
        try:
            await step()
        except Exception:  # noqa: BLE001 - a stopped clock would leave dead robots looking alive
            if not is_failing:
                _log.exception("%s failed; it will be tried again", name)
            is_failing = True
        else:
            if is_failing:
                _log.info("%s works again", name)
            is_failing = False
