"""Carries out ``mosaic operator pair`` and ``unpair``. A PIN is typed unseen or read from stdin, and is no argument."""

from __future__ import annotations

import hashlib
import json
import ssl
import sys

import typer

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.terminal.error_report import usage
from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
from mosaic_core.machines.lan.pairing_secret import pairing_secret
from mosaic_core.operator.lan.pairing import PairablePlace, pair_at, place_to_pair, unpair

_LONGEST_SECRET = 400


def pair_robot(robot: str, device: str, *, pin_stdin: bool, as_json: bool) -> None:
    """``mosaic operator pair``; raises :class:`MosaicError`."""
    set_up_logging(LogLevel.WARNING)
    if not pin_stdin and not sys.stdin.isatty():
        usage("no PIN: type it at a terminal or use --pin-stdin")
    place = run_event_loop(place_to_pair(robot))
    typer.echo(_place_text(place), err=True)
    if pin_stdin:
        secret = sys.stdin.readline(_LONGEST_SECRET)
    else:
        secret = typer.prompt("PIN or code on the robot's screen", hide_input=True, err=True)
    if not any(pairing_secret(secret).values()):
        where = "the first line of stdin is empty" if pin_stdin else "nothing but blanks was typed"
        usage(f"no PIN: {where}", "give it the PIN or code on the robot's screen")
    paired, role = run_event_loop(pair_at(place, secret, device))
    line = {"paired": True, "id": paired.robot_id, "name": paired.name, "url": paired.url, "role": role}
    typer.echo(
        json.dumps(line, ensure_ascii=False) if as_json else f"paired with {paired.name} ({paired.robot_id}) as {role}"
    )


def _place_text(place: PairablePlace) -> str:
    """What is known of who will be told the PIN."""
    where = f"{place.name} at {place.url}"
    if place.certificate:
        digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(place.certificate)).digest()
        return f"{where}; no authority vouches for its certificate, compare it: {digest.hex(':').upper()}"
    return where if place.url.startswith("https:") else f"{where}; over plain http whoever listens here reads along"


def unpair_robot(robot: str, *, as_json: bool) -> None:
    """``mosaic operator unpair``; raises :class:`MosaicError`."""
    set_up_logging(LogLevel.WARNING)
    is_told = run_event_loop(unpair(robot))
    if as_json:
        typer.echo(json.dumps({"unpaired": True, "robotWasTold": is_told}))
    else:
        typer.echo(f"{robot} is forgotten here")
    if not is_told:
        message = "warning: the robot was not reached and still lists this machine: `mosaic lan devices revoke` there"
        typer.secho(message, err=True, fg=typer.colors.YELLOW)
