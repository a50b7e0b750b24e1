"""Checks for `mosaic doctor` a server on its own machine: its data and its dashboard. Reads only; a running server goes
on.
"""

from __future__ import annotations

import asyncio
import os
import sqlite3
from collections.abc import AsyncIterator
from pathlib import Path

from mosaic_core.words.finding import Finding, failed, passed, skipped, warned
from mosaic_server.data_dir import FILE_NAME, default_data_dir
from mosaic_server.settings import DASHBOARD_DIR


async def examine(_context: object) -> AsyncIterator[Finding]:
    """Of the SQLite file; who uses another database knows how to look after it."""
    file = default_data_dir() / FILE_NAME
    if not file.exists():
        yield skipped("mosaic-server.data", f"No server has its data on this machine ({file.parent}).")
        return
    yield await asyncio.to_thread(data_finding, file)
    yield dashboard_finding(DASHBOARD_DIR)


def data_finding(file: Path) -> Finding:
    """Whether the file can be read and written, is whole, and knows a way to relay."""
    check, facts = "mosaic-server.data", {"file": str(file)}
    if not os.access(file, os.R_OK | os.W_OK):
        cure = "Look as the account that runs the server, or give the file to this one."
        return failed(check, "plugin.no_permission", f"This account may not use {file}.", cure, facts)
    try:
        database = sqlite3.connect(f"{file.as_uri()}?mode=ro", uri=True, timeout=2)
        try:
            whole = str(database.execute("PRAGMA quick_check(1)").fetchone()[0])
            relays = int(database.execute("SELECT COUNT(*) FROM ice_server").fetchone()[0])
        finally:
            database.close()
    except sqlite3.Error as error:
        cure = "Start the server once, which brings its tables up to date, or restore the file from a backup."
        return failed(check, "check.failed", f"The server's data can't be read: {error}.", cure, facts)
    if whole != "ok":
        cure = "Stop the server and restore the file from a backup."
        return failed(check, "check.failed", f"The server's data is damaged: {whole}.", cure, facts)
    if not relays:
        text = "The server of this machine hands out no STUN or TURN server."
        return warned(check, "ice.no_servers", text, facts=facts)
    return passed(check, f"The server's data is whole; it hands out {relays} ICE servers.", **facts)


def dashboard_finding(folder: Path) -> Finding:
    """Whether there is one to serve."""
    if (folder / "index.html").is_file():
        return passed("mosaic-server.dashboard", "The dashboard is built.")
    cure = "`npm ci && npm run build` in dashboard/."
    return warned("mosaic-server.dashboard", "check.failed", "The dashboard is not built.", cure)
