"""Runs the application under uvicorn: sans-IO WebSockets without compression, a quick end, a port to read back."""

from __future__ import annotations

import json
import logging
import os
import re
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import uvicorn

from mosaic_server.app import create_app
from mosaic_server.entrance.entrance import Entrance
from mosaic_server.entrance.listener import CountingListener, bound_sockets
from mosaic_server.entrance.places import EntrancePlace
from mosaic_server.entrance.timed_http import TimedHttp
from mosaic_server.services import Services
from mosaic_server.settings import Settings
from mosaic_server.sockets.link import LinkedProtocol

FAILED = 1
"""The exit code where it can't listen: uvicorn's own, 3, is that of a robot whose place another one took."""
_log = logging.getLogger(__name__)
_QUERY = re.compile(r"\?[^\s\"]*")

SHUTDOWN_S = 1
"""A slow client may not hold up the end: with this, SIGTERM to exit stays below two seconds."""


@dataclass(frozen=True, slots=True)
class Listening:
    """The addresses at which the server can be reached; what `--ready-file` and `--announce-fd` write."""

    host: str
    port: int
    scheme: str

    def to_json(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return json.dumps({"port": self.port, "url": f"{self.scheme}://{host}:{self.port}", "pid": os.getpid()})


class Server(uvicorn.Server):
    """uvicorn, telling when it listens and when it begins to end."""

    def __init__(
        self,
        config: uvicorn.Config,
        entrance: Entrance,
        on_listening: Callable[[Listening], None] | None = None,
        on_ending: Callable[[], object] | None = None,
    ) -> None:
        super().__init__(config)
        self._entrance = entrance
        self._on_listening = on_listening
        self._on_ending = on_ending

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        if self._on_ending is not None:
            self._on_ending()
        await super().shutdown(sockets)

    @property
    def services(self) -> Services:
        """While it listens."""
        services = self.config.app.state.services  # type: ignore[union-attr]
        assert isinstance(services, Services)
        return services

    async def on_tick(self, counter: int) -> bool:
        self._entrance.tick()
        return await super().on_tick(counter)

    def _protocol(self, place: EntrancePlace) -> TimedHttp:
        state = {"server_state": self.server_state, "app_state": self.lifespan.state}
        return TimedHttp(self._entrance, place, config=self.config, **state)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        try:
            listening = bound_sockets(self.config.host, self.config.port)
        except OSError as error:
            _log.error("can't listen on port %d of %s: %s", self.config.port, self.config.host, error)
            sys.exit(FAILED)
        await super().startup(sockets=[])  # it listens on none by itself
        if self.should_exit:
            for one in listening:
                one.close()
            return
        self.servers = [CountingListener(listening, self._entrance, self._protocol, self.config.ssl)]  # type: ignore[list-item]
        if self._on_listening is not None:
            port: int = listening[0].getsockname()[1]
            self._on_listening(Listening(self.config.host, port, "https" if self.config.is_ssl else "http"))


def make_server(
    settings: Settings,
    *,
    host: str = "127.0.0.1",
    port: int = 9001,
    ssl_certfile: Path | None = None,
    ssl_keyfile: Path | None = None,
    on_listening: Callable[[Listening], None] | None = None,
    on_ending: Callable[[], object] | None = None,
) -> Server:
    """A server ready for ``run()`` (blocks) or ``await serve()``; ``port=0`` takes a free one."""
    _keep_queries_out_of_logs()
    entrance = Entrance(settings.bounds, settings.trusted_proxies)
    config = uvicorn.Config(
        create_app(settings),
        host=host,
        port=port,
        ws=LinkedProtocol,
        ws_per_message_deflate=False,
        ws_ping_interval=None,  # the exchange pings, with periods of its own
        access_log=False,  # the guards log, without query strings
        log_config=None,
        server_header=False,
        ssl_certfile=ssl_certfile,
        ssl_keyfile=ssl_keyfile,
        timeout_graceful_shutdown=SHUTDOWN_S,
        timeout_keep_alive=30,
        proxy_headers=False,  # ForwardedRequests reads them
    )
    return Server(config, entrance, on_listening, on_ending)


def _keep_queries_out_of_logs() -> None:
    """uvicorn logs whole addresses; what follows the question mark may be a secret."""
    logging.getLogger("uvicorn.access").disabled = True
    logging.getLogger("uvicorn.error").addFilter(without_query)


def without_query(record: logging.LogRecord) -> bool:
    """A logging filter that takes query strings out of a record's arguments."""
    if isinstance(record.args, tuple):
        record.args = tuple(_QUERY.sub("", value) if isinstance(value, str) else value for value in record.args)
    return True


def announce(listening: Listening, *, ready_file: Path | None = None, announce_fd: int | None = None) -> None:
    """Tell a supervisor; the file appears complete or not at all."""
    if ready_file is not None:
        draft = ready_file.with_name(f".{ready_file.name}.{os.getpid()}")
        draft.write_text(listening.to_json() + "\n", encoding="utf-8")
        draft.replace(ready_file)
    if announce_fd is not None:
        with os.fdopen(announce_fd, "w", encoding="utf-8") as pipe:
            pipe.write(listening.to_json() + "\n")
    print(f"MOSAIC server on {json.loads(listening.to_json())['url']}", file=sys.stderr, flush=True)
