"""`mosaic server …` for tests, where hashing a password costs next to nothing: people sign in all the time, and no
password of theirs is kept there."""

from __future__ import annotations

from functools import partial

from mosaic_server.security.passwords import HashingCost, hash_at

CHEAP = HashingCost(passes=1, memory_kib=8, lanes=1)
"""A hash of 0.1 ms instead of 0.2 s."""

if __name__ == "__main__":
    from mosaic_core.cli.main import main
    from mosaic_server.cli import run
    from mosaic_server.settings import Settings

    hash_at(CHEAP)
    run.Settings = partial(Settings, hashing=CHEAP)  # type: ignore[misc, assignment]
    main()
