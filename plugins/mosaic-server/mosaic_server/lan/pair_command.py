"""``mosaic lan pair``: an offer beside the running server, shown here, until somebody takes it."""

from __future__ import annotations

import json
import time

import typer

from mosaic_core.words.lan import LanNews
from mosaic_server.cli.options import fail, opened
from mosaic_server.lan.home import LanHome, Reach
from mosaic_server.lan.offers import VOID, pairing_page
from mosaic_server.lan.screen import pairing_box
from mosaic_server.roles import Role
from mosaic_server.security.pairing import LIFETIME_S, PairingSecrets
from mosaic_server.storage.database import Database
from mosaic_server.storage.devices import devices, offer_state, open_offer, withdraw_offer

LOOK_S = 0.5
_ANY_HEIGHT = 1000
"""This output scrolls, so the QR code always fits."""


def paired_device(home: LanHome, reach: Reach, role: Role | None, *, waits: bool, as_json: bool) -> None:
    """Ends with exit code 1 if nobody came in time."""
    with opened(home.directory, None) as db:
        offer_id, shown = db.work(open_offer, role)
        _show(reach, shown, as_json)
        if not waits:
            return
        try:
            device = _waited(db, offer_id, as_json)
        except KeyboardInterrupt:
            device = None
        if device is None:
            db.work(withdraw_offer, offer_id)
            fail("nobody was paired; the PIN and the code are void now")
        name, is_now = next((one.name, one.role) for one in db.work(devices) if one.id == device)
    text = f"paired: {name}, {is_now}"
    typer.echo(json.dumps({"paired": device, "name": name, "role": is_now}) if as_json else text)


def _show(reach: Reach, shown: PairingSecrets, as_json: bool) -> None:
    page = pairing_page(reach.urls[0], shown.code) if reach.urls else ""
    if as_json:
        facts = {"robot": reach.name, "urls": reach.urls, "pin": shown.pin, "page": page, "forS": LIFETIME_S}
        typer.echo(json.dumps(facts))
        return
    typer.echo(pairing_box(LanNews(urls=reach.urls, only_here=reach.only_here, pin=shown.pin, page=page), _ANY_HEIGHT))
    if not reach.urls:
        typer.echo("this machine has no address on a network now; connect it to one", err=True)


def _waited(db: Database, offer_id: str, as_json: bool) -> str | None:
    """Who took it; ``None``: nobody within its time."""
    had_pin = True
    while True:
        state = db.work(offer_state, offer_id)
        if state.device is not None or not state.is_open:
            return state.device
        if had_pin and not state.has_pin and not as_json:
            typer.echo(VOID, err=True)
        had_pin = state.has_pin
        time.sleep(LOOK_S)
