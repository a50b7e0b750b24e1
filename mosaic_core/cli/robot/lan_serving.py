"""Gives a robot a server of its own for ``mosaic run --serve``: finds it by entry point, and shows what it says."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import entry_points

from mosaic_core.runtime.lan.lan_twin import LanTwin
from mosaic_core.runtime.signaling.server_link import LAN, KnownServer
from mosaic_core.words.errors import MosaicError, PluginError
from mosaic_core.words.lan import GROUP, LanChild, LanNews, LanServer
from mosaic_core.words.lan_wish import LanWish

logger = logging.getLogger(__name__)
_ROWS_FOR_THE_TABLE = 8


def lan_server() -> LanServer:
    """The installed one. Raises :class:`MosaicError` (``config.lan``) with what to install."""
    found = [*entry_points(group=GROUP)]
    if not found:
        message = "no server is installed that a robot could run for its own network"
        raise MosaicError(message, code="config.lan", cure='pip install "mosaic-server[lan]"')
    point = found[0]
    try:
        server: LanServer = point.load()()
    except Exception as error:  # a plugin's code may fail in any way
        source = f"{point.dist.name} {point.dist.version}" if point.dist else point.value
        message = f"the server of {source} can't be used: {type(error).__name__}: {error}"
        raise PluginError(message, distribution=source) from error
    return server


class LanServing:
    """The server of one robot, from before it starts to its last word."""

    def __init__(self, wish: LanWish) -> None:
        """Raises :class:`MosaicError` where it could never start."""
        self._server = lan_server()
        self._wish = wish
        self._child: LanChild = self._server.prepared(wish)
        self.news = LanNews()
        self._near_changed: Callable[[Sequence[str]], None] = lambda urls: None
        self._logged: tuple[object, ...] = ()

    def twin(self) -> LanTwin:
        """On the event loop that runs the robot."""
        from mosaic_core.adapters.signaling.websocket import open_websocket

        return LanTwin(self._child, partial(open_websocket, certificate=self._child.certificate), self._heard)

    def known(self, twin: LanTwin) -> KnownServer:
        return KnownServer(LAN, self._child.server, twin.connect)

    def shown(self, rows: int) -> str:
        """For a terminal with so many rows; empty while nothing is known."""
        return self._server.shown(self.news, rows - _ROWS_FOR_THE_TABLE) if self.news.urls else ""

    def on_news(self, near_changed: Callable[[Sequence[str]], None]) -> None:
        """Where the robot can be reached now, for its operators elsewhere."""
        self._near_changed = near_changed

    def _heard(self, news: LanNews) -> None:
        self.news = news
        self._near_changed(() if news.only_here else news.urls)
        spoken = (news.urls, news.notice)
        if spoken != self._logged and not self._wish.has_screen:
            self._logged = spoken
            where = ", ".join(news.urls) or "no address yet"
            if news.only_here:
                logger.info("on this machine alone: %s. Phones and other computers need --serve 0.0.0.0:PORT", where)
            else:
                logger.info("on this network: %s. `mosaic lan pair` lets a phone or computer in", where)
        if news.notice and self._wish.has_screen:
            logger.debug("%s", news.notice)
