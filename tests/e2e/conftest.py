"""People in a real Chromium: signed in without typing, and a browser of one's own that can be killed."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Playwright
from support.people import SIGN_IN, access_token
from support.processes import free_port, is_listening
from support.waiting import wait_for


@pytest.fixture(scope="module")
def sign_in(server: Any, seed: Any) -> Callable[[Page], None]:
    """`sign_in(page)`: the person of `seed` is signed in on this page, as after a reload."""
    token = access_token(server.url, seed.email, seed.password)

    def signed_in(page: Page) -> None:
        page.goto(server.plain_url)
        page.evaluate(SIGN_IN, token)

    return signed_in


@dataclass
class OwnBrowser:
    """A browser process of its own, so that it can be killed or stopped by its pid."""

    process: subprocess.Popen[bytes]
    browser: Browser


@pytest.fixture
def own_browser(
    playwright: Playwright, whole_chromium: str, quiet_words: list[str], tmp_path: Path
) -> Iterator[OwnBrowser]:
    port = free_port()
    words = [
        whole_chromium,
        *quiet_words,
        f"--user-data-dir={tmp_path}",
        f"--remote-debugging-port={port}",
        "about:blank",
    ]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_for(lambda: is_listening(port), "the browser takes connections", alive=process)
    yield OwnBrowser(process, playwright.chromium.connect_over_cdp(f"http://127.0.0.1:{port}"))
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # its helper processes too, also while they are stopped
    process.wait(timeout=10)
