"""``mosaic server …``: run the server, and look after its accounts, robots and ICE servers."""

from mosaic_server.cli.commands import app

__all__ = ["app"]
