"""`mosaic server …`, whose TURN credentials end after seconds: no operator may ask for less than a minute."""

from __future__ import annotations

from typing import Any

from mosaic_core.cli.main import main
from mosaic_server.sockets.authorizer import Authorizer

LIFETIME_S = 8.0

if __name__ == "__main__":
    begin = Authorizer.__init__

    def begin_short(self: Authorizer, database: Any, access_tokens: Any, _lifetime_s: float = LIFETIME_S) -> None:
        begin(self, database, access_tokens, LIFETIME_S)

    Authorizer.__init__ = begin_short  # type: ignore[method-assign]
    main()
