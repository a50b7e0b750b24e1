"""``mosaic lan devices …``: who was paired with this robot."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import AsJson, fail, nearest, opened, role_refusals, show_table
from mosaic_server.roles import Role

if TYPE_CHECKING:
    from mosaic_server.storage.database import Database
    from mosaic_server.storage.devices import ListedDevice

app = typer.Typer(help="Paired phones and computers.", no_args_is_help=True)
DeviceArgument = Annotated[str, typer.Argument(help="Its name, or the first characters of its id.")]
HomeDir = Annotated[Path | None, typer.Option(help="Where the robot keeps its things; default: as it does.")]


@app.command("list")
def show_all(data_dir: HomeDir = None, as_json: AsJson = False) -> None:
    """List the paired devices, the oldest first."""
    from mosaic_server.lan.home import LanHome
    from mosaic_server.storage.devices import devices

    with opened(LanHome(data_dir).directory, None) as db:
        found = db.work(devices)
    rows = [
        {
            "name": one.name,
            "id": one.id if as_json else one.id[:8],
            "role": one.role,
            "paired": _time(one.paired_at_ms),
            "last connected": _time(one.connected_at_ms),
            "from": one.address,
        }
        for one in found
    ]
    show_table(rows, as_json=as_json)


@app.command("revoke")
def revoke(device: DeviceArgument, data_dir: HomeDir = None) -> None:
    """Sign a device out for good; its connections end within two seconds."""
    from mosaic_server.lan.home import LanHome
    from mosaic_server.storage.devices import revoke_device
    from mosaic_server.storage.grants import BY_COMMAND

    with opened(LanHome(data_dir).directory, None) as db:
        one = _known(db, device)
        db.work(revoke_device, one.id, BY_COMMAND)
    typer.echo(f"revoked {one.name} ({one.id[:8]})")


@app.command("role")
def change_role(
    device: DeviceArgument,
    role: Annotated[Role, typer.Argument(help="What it may do from now on.")],
    data_dir: HomeDir = None,
) -> None:
    """Say what a device may do: observer, operator or supervisor. It connects again with the new role."""
    from mosaic_server.lan.home import LanHome
    from mosaic_server.storage.devices import change_device_role
    from mosaic_server.storage.grants import BY_COMMAND

    with opened(LanHome(data_dir).directory, None) as db, role_refusals():
        one = _known(db, device)
        db.work(change_device_role, one.id, role, BY_COMMAND)
    typer.echo(f"{one.name} is {role} now")


def _known(db: Database, wanted: str) -> ListedDevice:
    """The device, or the end with the nearest name."""
    from mosaic_server.storage.devices import devices

    every = db.work(devices)
    found = [one for one in every if one.name == wanted] or [one for one in every if one.id.startswith(wanted.lower())]
    if len(found) > 1:
        fail(f"{len(found)} devices are meant by {wanted!r}; use more of the id", exit_code=2)
    if not found:
        fail(f"no device {wanted!r}{nearest(wanted, [one.name for one in every]) or '; see `mosaic lan devices list`'}")
    return found[0]


def _time(ms: int | None) -> str:
    if ms is None:
        return "never"
    return datetime.fromtimestamp(ms / 1000, UTC).astimezone().strftime("%Y-%m-%d %H:%M")
