"""The program that a robot starts for its own network: server, offers to pair, announcement, and news for the robot.

It ends when its standard input does, which is when the robot ends, however that happens.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from types import FrameType
from typing import Annotated, NoReturn

import typer
from sqlalchemy.exc import SQLAlchemyError

from mosaic_core.machines.lan.robot_url import url_of
from mosaic_core.words.lan import LanNews
from mosaic_server.cli.logs import configure_logs
from mosaic_server.lan.addresses import is_only_here, lan_addresses, names_of_certificate, own_names
from mosaic_server.lan.announcement import Announced, Announcement
from mosaic_server.lan.home import LanHome, Reach
from mosaic_server.lan.offers import StandingOffer
from mosaic_server.serving import Server, make_server
from mosaic_server.settings import LOOPBACK_HOSTS, Settings
from mosaic_server.storage.database import Database, DatabaseInUse
from mosaic_server.storage.devices import adopt_robot

_log = logging.getLogger(__name__)
LOOK_S = 1.0
"""How often devices, offers and addresses are looked at."""
REVOCATION_S = 1.0
"""`mosaic lan devices revoke` takes effect within this."""


@dataclass(frozen=True, slots=True)
class ServingPlace:
    """The place of a robot's own server: its directory, address and certificate, and the robot that it serves."""

    home: LanHome
    host: str
    port: int
    robot_id: str
    name: str
    certificate: Path | None
    key: Path | None
    serves_widgets: bool = True

    @property
    def scheme(self) -> str:
        return "http" if self.certificate is None else "https"

    @property
    def is_only_here(self) -> bool:
        return is_only_here(self.host)

    def names(self) -> list[str]:
        return own_names() if self.certificate is None else names_of_certificate(self.certificate)

    def announced(self) -> Announced:
        fingerprint = "" if self.certificate is None else fingerprint_of(self.certificate)
        return Announced(self.name, self.robot_id, self.port, self.scheme, version("mosaic-server"), fingerprint)

    def urls(self, addresses: list[str], hostname: str) -> tuple[str, ...]:
        """Names of a certificate first, for only those are trusted; else addresses first, for they always work."""
        if self.is_only_here:
            addresses = [self.host]
        if self.certificate is not None:
            hosts = [*self.names(), *addresses]
        else:
            hosts = [*addresses, *([hostname] if hostname else [])]
        return tuple(url_of(self.scheme, host, self.port) for host in dict.fromkeys(hosts))

    def settings(self, announced: Announced) -> Settings:
        return Settings(
            data_dir=self.home.directory,
            allowed_hosts=frozenset({*LOOPBACK_HOSTS, *self.names(), *own_names(), announced.hostname}),
            pairs_with=self.name,
            serves_widgets=self.serves_widgets,
            revocation_check_s=REVOCATION_S,
        )


def run(
    home: Annotated[Path, typer.Option()],
    host: Annotated[str, typer.Option()],
    port: Annotated[int, typer.Option()],
    robot_id: Annotated[str, typer.Option()],
    name: Annotated[str, typer.Option()],
    tls_cert: Annotated[Path | None, typer.Option()] = None,
    tls_key: Annotated[Path | None, typer.Option()] = None,
    offer_pins: Annotated[bool, typer.Option("--offer-pins")] = False,
    widgets: Annotated[bool, typer.Option("--widgets/--no-widgets")] = True,
) -> None:
    """Serve until standard input ends. `mosaic run --serve` starts this; it is no command for people."""
    configure_logs("info", "json")
    logging.getLogger("mosaic_server.access").setLevel(logging.WARNING)
    logging.getLogger("uvicorn").setLevel(logging.WARNING)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _end)  # uvicorn takes them over while it runs and hands the signal back afterwards
    place = ServingPlace(LanHome(home), host, port, robot_id, name, tls_cert, tls_key, widgets)
    try:
        _adopt(place)
    except (DatabaseInUse, SQLAlchemyError, OSError) as error:
        _log.error("the database of the robot's own server can't be used: %s", error)
        raise typer.Exit(1) from error
    asyncio.run(_serve(place, offer_pins))


def _end(_number: int, _frame: FrameType | None) -> NoReturn:
    sys.exit(0)


def main() -> None:
    typer.run(run)


def _adopt(place: ServingPlace) -> None:
    database = Database(place.home.directory)
    try:
        database.lock()
        database.migrate()
        database.work(adopt_robot, place.robot_id, place.name, place.home.robot_token())
    finally:
        database.close()


async def _serve(place: ServingPlace, offer_pins: bool) -> None:
    listening = asyncio.Event()
    server = make_server(
        place.settings(place.announced()),
        host=place.host,
        port=place.port,
        ssl_certfile=place.certificate,
        ssl_keyfile=place.key,
        on_listening=lambda _: listening.set(),
        on_ending=lambda: telling.cancel(),  # it takes half a second to say good-bye on the network
    )
    telling = asyncio.create_task(_tell(place, server, listening, offer_pins))
    following = asyncio.create_task(_end_with_the_robot(server))
    try:
        await server.serve()
    finally:
        for task in (telling, following):
            task.cancel()
        await asyncio.gather(telling, following, return_exceptions=True)
    if not server.started:
        raise typer.Exit(1)


async def _end_with_the_robot(server: Server) -> None:
    reader = asyncio.StreamReader()
    loop = asyncio.get_running_loop()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(1024):
        pass
    server.should_exit = True


async def _tell(place: ServingPlace, server: Server, listening: asyncio.Event, offer_pins: bool) -> None:
    """Say how things stand whenever that changes, from the moment on when the server listens."""
    await listening.wait()
    announcement = Announcement(place.announced())
    teller = _Teller(place, announcement, StandingOffer(offers_pins=offer_pins))
    is_failing = False
    try:
        while True:
            try:
                await teller.look(server.services.database)
                is_failing = False
            except (SQLAlchemyError, OSError) as error:
                if not is_failing:
                    _log.error("devices can't be paired now: %s", error)
                is_failing = True
            await asyncio.sleep(LOOK_S)
    finally:
        with contextlib.suppress(OSError):
            await announcement.withdraw()


class _Teller:
    """Tells the robot about its server, and remembers the last so that only changes are told."""

    def __init__(self, place: ServingPlace, announcement: Announcement, offers: StandingOffer) -> None:
        self._place = place
        self._announcement = announcement
        self._offers = offers
        self._addresses: list[str] | None = None
        self._told: LanNews | None = None

    async def look(self, database: Database) -> None:
        addresses = lan_addresses(self._place.host)
        hostname = self._announcement.hostname if addresses else ""
        urls = self._place.urls(addresses, hostname)
        where = LanNews(urls=urls, only_here=self._place.is_only_here, hostname=hostname)
        news = await database.run(self._offers.news, where)
        if news != self._told:
            self._told = news
            self._place.home.tell_reach(Reach(self._place.name, self._place.robot_id, urls, where.only_here))
            print(news.model_dump_json(by_alias=True), flush=True)
        if addresses != self._addresses:
            self._addresses = addresses
            await self._announcement.show(addresses)


def fingerprint_of(certificate: Path) -> str:
    """SHA-256 of the first certificate in a PEM file, as browsers show it."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes

    return x509.load_pem_x509_certificate(certificate.read_bytes()).fingerprint(hashes.SHA256()).hex(":").upper()
