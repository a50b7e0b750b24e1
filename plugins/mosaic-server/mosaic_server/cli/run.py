"""``mosaic server run``."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

import typer

from mosaic_core.machines.peers.home_address import is_loopback
from mosaic_server.cli.options import DatabaseUrl, DataDir, fail
from mosaic_server.entrance.bounds import DEFAULT_BOUNDS, Bounds
from mosaic_server.entrance.forwarded import ProxyHeader
from mosaic_server.entrance.proxies import proxy_in
from mosaic_server.security.turn_credentials import MAX_LIFETIME_S
from mosaic_server.tls_files import tls_mistake

if TYPE_CHECKING:
    from mosaic_server.settings import Settings


def run(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free port.")] = 9001,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    ssl_certfile: Annotated[Path | None, typer.Option(exists=True, dir_okay=False, help="TLS certificate.")] = None,
    ssl_keyfile: Annotated[Path | None, typer.Option(exists=True, dir_okay=False, help="Its private key.")] = None,
    insecure_public: Annotated[
        bool, typer.Option("--insecure-public", help="Listen beyond this machine without TLS all the same.")
    ] = False,
    allow_signup: Annotated[bool, typer.Option("--allow-signup", help="Anybody may make an account.")] = False,
    allow_host: Annotated[
        list[str] | None, typer.Option(help="Answer only to this name in the Host header; repeatable.")
    ] = None,
    allow_origin: Annotated[
        list[str] | None, typer.Option(help="Pages from here may connect too, e.g. http://localhost:5173; repeatable.")
    ] = None,
    trusted_proxy: Annotated[
        list[str] | None,
        typer.Option(help="Believe --proxy-header of this proxy, e.g. 127.0.0.1 or 10.0.0.0/8; repeatable."),
    ] = None,
    proxy_header: Annotated[
        ProxyHeader,
        typer.Option(case_sensitive=False, help="The one header in which the proxies say who spoke to them."),
    ] = ProxyHeader.X_FORWARDED_FOR,
    connections_per_address: Annotated[
        int, typer.Option(min=10, help="Connections that one address may hold.")
    ] = DEFAULT_BOUNDS.connections_per_address,
    requests_per_s: Annotated[
        float, typer.Option("--requests-per-second", min=1, help="Requests of one address; more wait for their turn.")
    ] = DEFAULT_BOUNDS.requests_per_s,
    widgets: Annotated[
        bool, typer.Option("--widgets/--no-widgets", help="Serve the widgets of plugins that are installed here.")
    ] = True,
    audit_days: Annotated[float, typer.Option(min=1, help="How long entries of the audit log are kept.")] = 90.0,
    turn_lifetime: Annotated[
        float,
        typer.Option(min=60, max=MAX_LIFETIME_S, help="Seconds for which TURN credentials open a new relay."),
    ] = MAX_LIFETIME_S,
    ready_file: Annotated[Path | None, typer.Option(help='Write {"port": …} here once listening.')] = None,
    announce_fd: Annotated[int | None, typer.Option(help="Write the same to this file descriptor.")] = None,
    log_level: Annotated[Literal["debug", "info", "warning", "error"], typer.Option(help="How much to log.")] = "info",
    log_format: Annotated[Literal["text", "json"], typer.Option(help="For people or for programs.")] = "text",
) -> None:
    """Run the server until SIGINT or SIGTERM."""
    from mosaic_server.cli.logs import configure_logs
    from mosaic_server.data_dir import default_data_dir
    from mosaic_server.serving import announce, make_server
    from mosaic_server.settings import LOOPBACK_HOSTS, Settings

    configure_logs(log_level, log_format)
    if (ssl_certfile is None) != (ssl_keyfile is None):
        fail("--ssl-certfile and --ssl-keyfile go together", exit_code=2)
    if ssl_certfile is not None and ssl_keyfile is not None and (mistake := tls_mistake(ssl_certfile, ssl_keyfile)):
        fail(f"{mistake}; give PEM files that belong together", exit_code=2)
    is_local = is_loopback(host)
    if not is_local and ssl_certfile is None:
        _check_public(host, insecure_public)
    settings = Settings(
        data_dir=data_dir or default_data_dir(),
        database_url=database,
        allow_signup=allow_signup,
        allowed_hosts=frozenset(allow_host or (LOOPBACK_HOSTS if is_local else ())),
        allowed_origins=frozenset(map(_origin, allow_origin or ())),
        trusted_proxies=tuple(map(_proxy, trusted_proxy or ())),
        proxy_header=proxy_header,
        bounds=Bounds(connections_per_address=connections_per_address, requests_per_s=requests_per_s),
        uses_tls=ssl_certfile is not None,
        serves_widgets=widgets,
        audit_days=audit_days,
        turn_lifetime_s=turn_lifetime,
    )
    _check_database(settings)
    server = make_server(
        settings,
        host=host,
        port=port,
        ssl_certfile=ssl_certfile,
        ssl_keyfile=ssl_keyfile,
        on_listening=lambda listening: announce(listening, ready_file=ready_file, announce_fd=announce_fd),
    )
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _end)  # uvicorn takes them over while it runs and hands the signal back afterwards
    server.run()
    if not server.started:
        raise typer.Exit(1)


def _end(_number: int, _frame: FrameType | None) -> NoReturn:
    sys.exit(0)


def _origin(text: str) -> str:
    from mosaic_server.web.origins import origin_in

    try:
        return origin_in(text)
    except ValueError as error:
        fail(f"--allow-origin: {error}", exit_code=2)


def _proxy(text: str) -> str:
    try:
        return proxy_in(text)
    except ValueError as error:
        fail(f"--trusted-proxy: {error}", exit_code=2)


def _check_public(host: str, insecure_public: bool) -> None:
    danger = f"on {host} without TLS, passwords, tokens and log-ins can be read by anybody on the way"
    if not insecure_public:
        cure = "give --ssl-certfile and --ssl-keyfile, put a TLS proxy in front of 127.0.0.1, or insist with"
        fail(f"{danger}; {cure} --insecure-public", exit_code=2)
    typer.echo(f"warning: {danger}", err=True)


def _check_database(settings: Settings) -> None:
    """Say what is wrong in one sentence before uvicorn turns it into a traceback."""
    from sqlalchemy.exc import SQLAlchemyError

    from mosaic_server.storage.database import Database, DatabaseInUse

    try:
        database = Database(settings.data_dir, settings.database_url)
        try:
            database.lock()
            database.migrate()
        finally:
            database.close()
    except DatabaseInUse as error:
        fail(str(error))
    except OSError as error:
        fail(f"the data directory can't be used: {error}; name a folder that you may write", exit_code=2)
    except (SQLAlchemyError, ModuleNotFoundError) as error:
        fail(f"the database can't be opened: {error}", exit_code=2)
