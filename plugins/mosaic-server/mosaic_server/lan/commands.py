"""``mosaic lan …``: pair a device with the robot that serves this network, list and revoke devices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_core.words.errors import MosaicError
from mosaic_server.cli.options import AsJson
from mosaic_server.lan.device_commands import HomeDir
from mosaic_server.lan.device_commands import app as devices_app
from mosaic_server.roles import Role

if TYPE_CHECKING:
    from mosaic_server.lan.home import LanHome, Reach

app = typer.Typer(
    add_completion=False, help="Robots that serve their own network: `mosaic run --serve`.", no_args_is_help=True
)
app.add_typer(devices_app, name="devices")


@app.command("pair")
def pair(
    role: Annotated[
        Role | None, typer.Option(help="What the device may do; default: operator, the first device: supervisor.")
    ] = None,
    wait: Annotated[bool, typer.Option(help="Wait until a device is paired.")] = True,
    data_dir: HomeDir = None,
    as_json: AsJson = False,
) -> None:
    """Let one more phone or computer in: shows a PIN and a QR code for five minutes."""
    from mosaic_server.lan.home import LanHome
    from mosaic_server.lan.pair_command import paired_device

    home = LanHome(data_dir)
    paired_device(home, reach_of(home), role, waits=wait, as_json=as_json)


def reach_of(home: LanHome) -> Reach:
    """Raises :class:`MosaicError` where no robot serves."""
    reach = home.reach()
    if reach is None:
        message = f"no robot serves its network from {home.directory} now"
        cure = "start it with `mosaic run --serve`, as this user and with the same MOSAIC_DATA_DIR"
        raise MosaicError(message, code="config.lan", cure=cure)
    return reach
