"""``mosaic server ice …``"""

from __future__ import annotations

from typing import Annotated

import typer
from pydantic import ValidationError

from mosaic_core.words.ice import IceServer
from mosaic_server.cli.options import AsJson, DatabaseUrl, DataDir, fail, opened, show, show_table
from mosaic_server.storage.ice_servers import add_ice_server, listed_ice_servers, remove_ice_server

app = typer.Typer(help="STUN and TURN servers that operators and robots are given.", no_args_is_help=True)


@app.command("add")
def add(
    urls: Annotated[list[str], typer.Argument(help="stun:host:port, turn:host:port?transport=tcp, turns:host …")],
    username: Annotated[str | None, typer.Option(help="For TURN.")] = None,
    credential: Annotated[
        str | None, typer.Option(envvar="MOSAIC_TURN_CREDENTIAL", help="For TURN; better in the environment.")
    ] = None,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Add an ICE server with one or several URLs."""
    try:
        server = IceServer(urls=tuple(urls), username=username, credential=credential)
    except ValidationError as error:
        fail("; ".join(problem["msg"] for problem in error.errors()), exit_code=2)
    with opened(data_dir, database) as db:
        new_id = db.work(add_ice_server, server)
    show({"id": new_id, "urls": server.urls}, as_json=as_json, text=f"{new_id}  {' '.join(server.urls)}")


@app.command("list")
def show_all(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List all ICE servers; credentials are not shown."""
    with opened(data_dir, database) as db:
        servers = db.work(listed_ice_servers)
    rows = [{"id": one_id, "urls": " ".join(one.urls), "username": one.username or ""} for one_id, one in servers]
    show_table(rows, as_json=as_json)


@app.command("remove")
def remove(
    ice_server_id: Annotated[str, typer.Argument(help="The id that `list` shows.")],
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Remove an ICE server."""
    with opened(data_dir, database) as db:
        if not db.work(remove_ice_server, ice_server_id):
            fail(f"no ICE server {ice_server_id!r}; see `mosaic server ice list`")
    typer.echo("removed")
