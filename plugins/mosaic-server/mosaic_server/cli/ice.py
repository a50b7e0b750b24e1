"""``mosaic server ice …``"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import AsJson, DatabaseUrl, DataDir, fail, opened, show, show_table

if TYPE_CHECKING:
    from mosaic_server.storage.ice_servers import StoredIceServer

app = typer.Typer(help="STUN and TURN servers that operators and robots are given.", no_args_is_help=True)

MAX_SECRET_LENGTH = 512
NO_CREDENTIALS = (
    "a TURN server needs credentials, or no browser connects to any robot: give --secret-file with the "
    "static-auth-secret of coturn, or both --username and --credential"
)


@app.command("add")
def add(
    urls: Annotated[list[str], typer.Argument(help="stun:host:port, turn:host:port?transport=tcp, turns:host …")],
    username: Annotated[str | None, typer.Option(help="For TURN with one password for everybody.")] = None,
    credential: Annotated[
        str | None,
        typer.Option(envvar="MOSAIC_TURN_CREDENTIAL", help="That password; better in the environment."),
    ] = None,
    secret_file: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="File with coturn's static-auth-secret.")
    ] = None,
    secret_env: Annotated[str | None, typer.Option(help="Name of an environment variable that holds it.")] = None,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Add an ICE server with one or several URLs. With a shared secret everybody gets credentials that end soon."""
    from pydantic import ValidationError

    from mosaic_core.words.ice import IceServer
    from mosaic_server.storage.ice_servers import add_ice_server

    secret = _secret(secret_file, secret_env)
    if secret is not None and (username is not None or credential is not None):
        fail("a shared secret makes the credentials: leave out --username and --credential", exit_code=2)
    try:
        server = IceServer(urls=tuple(urls), username=username, credential=credential)
    except ValidationError as error:
        fail("; ".join(problem["msg"] for problem in error.errors()), exit_code=2)
    if secret is not None and not any(url.startswith("turn") for url in server.urls):
        fail("a shared secret is for TURN: name a turn: or turns: URL", exit_code=2)
    if secret is None and server.lacks_credentials:
        fail(NO_CREDENTIALS, exit_code=2)
    with opened(data_dir, database) as db:
        new_id = db.work(add_ice_server, server, secret)
    show({"id": new_id, "urls": server.urls}, as_json=as_json, text=f"{new_id}  {' '.join(server.urls)}")


def _secret(file: Path | None, variable: str | None) -> str | None:
    """The shared secret from where it was said to be; never from the command line, which everybody can read."""
    if file is None and variable is None:
        return None
    if file is not None and variable is not None:
        fail("--secret-file or --secret-env, not both", exit_code=2)
    if file is not None:
        source = f"the file {file}"
        try:
            secret = file.read_text().strip()
        except (OSError, UnicodeDecodeError) as error:
            fail(f"{source} can't be read: {error}", exit_code=2)
    else:
        source = f"the environment variable {variable}"
        secret = os.environ.get(variable or "", "").strip()
    if not secret:
        fail(f"{source} holds no secret; it is what turnserver.conf calls static-auth-secret", exit_code=2)
    if len(secret) > MAX_SECRET_LENGTH or "\n" in secret:
        fail(f"{source} holds more than one line of {MAX_SECRET_LENGTH} characters", exit_code=2)
    return secret


@app.command("list")
def show_all(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List all ICE servers; credentials and secrets are not shown."""
    from mosaic_server.storage.ice_servers import listed_ice_servers

    with opened(data_dir, database) as db:
        servers = db.work(listed_ice_servers)
    rows = [
        {
            "id": one.id,
            "urls": " ".join(one.server.urls),
            "credentials": _kind(one),
            "username": one.server.username or "",
        }
        for one in servers
    ]
    show_table(rows, as_json=as_json)


def _kind(entry: StoredIceServer) -> str:
    if entry.secret is not None:
        return "time-limited"
    if entry.lacks_credentials:
        return "missing"
    return "none" if entry.server.credential is None else "fixed"


@app.command("remove")
def remove(
    ice_server_id: Annotated[str, typer.Argument(help="The id that `list` shows.")],
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Remove an ICE server."""
    from mosaic_server.storage.ice_servers import remove_ice_server

    with opened(data_dir, database) as db:
        if not db.work(remove_ice_server, ice_server_id):
            fail(f"no ICE server {ice_server_id!r}; see `mosaic server ice list`")
    typer.echo("removed")
