"""Draws what a person at the robot sees: where to open the page, the PIN to type, and a QR code that does both."""

from __future__ import annotations

import io
import shutil
from urllib.parse import urlsplit

import segno
from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from mosaic_core.words.lan import LanNews
from mosaic_core.words.lan_wish import DEFAULT_PORT

_QUIET_ZONE = 2
"""Modules of white around it. The standard wants 4; on white of our own, phones read it with 2."""
_QR_STYLE = "#000000 on #ffffff"
"""Both colours said, so that it can be read on light and on dark terminals."""
_FRAME_ROWS, _FRAME_COLUMNS = 2, 8
_TEXT_COLUMNS = 34
NO_TLS = (
    "Over http a browser gives no microphone and lets the screen go to sleep; --tls-cert and --tls-key change that."
)
_NEARBY = "drive this robot from a phone or computer nearby"
_HERE = "drive this robot on this machine"


def pairing_box(news: LanNews, height: int, width: int | None = None) -> str:
    """For a terminal with ``height`` free lines, with its escape sequences. Once a device is paired, two lines do."""
    columns = width or shutil.get_terminal_size().columns
    console = Console(
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
        width=columns,
        highlight=False,
        legacy_windows=False,
    )
    code = [] if news.only_here else qr_text(news.page)  # whoever could scan it could not open it
    console.print(_short(news) if news.devices else _box(news, code, height, columns))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().rstrip("\n")


def spoken_pin(pin: str) -> str:
    """``12345678`` → ``1234 5678``: read and typed in two breaths."""
    middle = (len(pin) + 1) // 2
    return f"{pin[:middle]} {pin[middle:]}".strip()


def qr_text(page: str) -> list[str]:
    """The QR code of an address as lines of half blocks, two modules high; empty without an address."""
    if not page:
        return []
    rows = [list(row) for row in segno.make(page, error="l", micro=False).matrix_iter(border=_QUIET_ZONE)]
    if len(rows) % 2:
        rows.append([0] * len(rows[0]))
    halves = {(0, 0): " ", (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}
    return [
        "".join(halves[int(bool(upper)), int(bool(lower))] for upper, lower in zip(above, below, strict=True))
        for above, below in zip(rows[::2], rows[1::2], strict=True)
    ]


def _short(news: LanNews) -> RenderableType:
    line = Text.assemble(("lan ", "dim"), "  ".join(news.urls))
    if news.pin:
        line.append("   PIN ", style="dim").append(spoken_pin(news.pin), style="bold")
    paired = "1 device paired" if news.devices == 1 else f"{news.devices} devices paired"
    more = "only this machine can open it." if news.only_here else "`mosaic lan pair` shows a QR code."
    return Group(line, Text(f"    {paired}; {more} {news.notice}".rstrip(), style="dim"))


def _box(news: LanNews, code: list[str], height: int, width: int) -> Panel:
    words = _words(news)
    fits_beside = bool(code) and len(code[0]) + _TEXT_COLUMNS + _FRAME_COLUMNS <= width
    if not code or len(code) + _FRAME_ROWS > height or not fits_beside:
        content: RenderableType = Group(*words)
    else:
        content = Table.grid(padding=(0, 3, 0, 0))
        content.add_column(no_wrap=True)
        content.add_column()
        content.add_row(Text("\n".join(code), style=_QR_STYLE), Group(*words))
    return Panel(content, title=_HERE if news.only_here else _NEARBY, title_align="left", expand=False)


def _for_phones(news: LanNews) -> str:
    """The option that lets others in, on the port that the robot has."""
    url = urlsplit(next(iter(news.urls), f"http://127.0.0.1:{DEFAULT_PORT}"))
    return f"--serve 0.0.0.0:{url.port or (443 if url.scheme == 'https' else 80)}"


def _words(news: LanNews) -> list[RenderableType]:
    words: list[RenderableType] = [Text(url, style="bold") for url in news.urls]
    if news.pin:
        words += [Text(), Text.assemble("PIN  ", (spoken_pin(news.pin), "bold green"))]
    if news.only_here:
        words.append(Text(f"Only this machine can open it, and pair with the PIN; for phones: {_for_phones(news)}"))
    elif news.page or news.pin:
        words.append(
            Text("Scan, or open an address and type the PIN. Each pairs one device; new ones every 5 minutes.")
        )
    if news.urls and news.urls[0].startswith("http:") and not news.only_here:
        words += [Text(), Text(NO_TLS, style="dim")]
    return [*words, Text(news.notice, style="yellow")] if news.notice else words
