"""``mosaic config``: a file to start from, and its schema for editors."""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.configuration.local_option import HERE, LocalOption, resolver_beside
from mosaic_core.cli.terminal.error_report import usage

_HEAD = """\
# A MOSAIC robot. Check this file with `mosaic validate`, run it with `mosaic run`.
# ${NAME} reads an environment variable, ${file:/run/secrets/x} a file; write $${ for the characters themselves.
version: 1

server:
  # Where your server listens, without a path: wss:// behind TLS, ws:// on this machine or a trusted network.
  ws_url: ws://127.0.0.1:9001
  auth:
    type: simple-token
    # `mosaic server robot add NAME` shows both once. The id may stand here as it is; keep the token out of the file.
    robot_id: ${MOSAIC_ROBOT_ID}
    params:
      token: ${MOSAIC_TOKEN}
  # The server hands out its own STUN and TURN servers; more can be named here.
  # webrtc:
  #   ice_servers:
  #     - { urls: ["turn:turn.example.org:3478"], username: robot, credential: "${TURN_PASSWORD}" }

# Each connector: its type (`mosaic connectors list`), a label of your choice that operators see, and the type's own
# params (`mosaic connectors show TYPE`).
connectors:
"""

_CONNECTORS = {
    "connection-check": """\
  # Measures the round trip between operator and robot.
  - type: connection-check
    label: link
""",
    "host-load": """\
  # Processor, memory, disk and temperature of this computer.
  - type: host-load
    label: host
""",
    "camera": """\
  # A webcam, a video file or an RTSP/HTTP URL. Nobody watching: nothing is captured.
  - type: camera
    label: front
    params:
      source: /dev/video0
      width: 640
      height: 480
      fps: 30
""",
    "cmd-vel": """\
  # Velocity commands. The drive `log` only writes what it would do; `mosaic connectors show cmd-vel` lists others.
  - type: cmd-vel
    label: cmd_vel
    params:
      drive: { type: log }
    # Enforced on the robot: silence stops it, faster commands are clamped.
    safety:
      timeout_s: 0.3
      max_linear_mps: 0.5
      max_angular_radps: 1.0
    delivery: latest
""",
}


def config_template(installed: Collection[str]) -> str:
    """The commented file; connectors whose type is not installed are left out."""
    connectors = [text for name, text in _CONNECTORS.items() if name in installed]
    return _HEAD + ("\n".join(connectors) if connectors else "  []\n")


app = typer.Typer(add_completion=False, no_args_is_help=True, help="The robot's YAML file.")


@app.command()
def schema(local_connectors: LocalOption = None) -> None:
    """Print the JSON Schema of the file, with the params of every installed connector.

    Editors complete and check from it; with the YAML language server, for example, write the output to
    mosaic.schema.json and put `# yaml-language-server: $schema=mosaic.schema.json` at the top of the YAML file.
    """
    from mosaic_core.cli.configuration.config_schema import config_schema

    result, broken = config_schema(resolver_beside(HERE, local_connectors))
    for error in broken:
        typer.secho(f"left out: {error.message}", err=True, fg=typer.colors.YELLOW)
    typer.echo(json.dumps(result, indent=2, ensure_ascii=False))


@app.command()
def init(
    path: Annotated[Path, typer.Argument(help="The file to write.")] = Path("mosaic_config.yaml"),
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a commented file to start from. Only its owner can read it, because it may hold the robot's token."""
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    text = config_template({one.type for one in ConnectorResolver().types()})
    flags = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if force else os.O_EXCL)
    try:
        with os.fdopen(os.open(path, flags, 0o600), "w", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        usage(f"{path} exists; --force replaces it")
    except OSError as error:
        cure = "name a file in a folder that you may write"
        usage(f"{path} can't be written: {error.strerror}", cure if path.parent.is_dir() else f"mkdir -p {path.parent}")
    typer.echo(f"wrote {path}; next:\n  export MOSAIC_ROBOT_ID=… MOSAIC_TOKEN=…   # as your server shows them")
    typer.echo(f"  mosaic validate {path}\n  mosaic run {path}")
