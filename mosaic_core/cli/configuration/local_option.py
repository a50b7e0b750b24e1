"""The option that decides whether code of the folder ``connectors/`` beside a robot's YAML file is run.

A person at a terminal has seen the folder. A service starts unseen, so it runs what is installed, unless it is told to.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

if TYPE_CHECKING:
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

HERE = Path("mosaic_config.yaml")
"""The file that commands about connectors alone look beside: they are about the current folder."""

LocalOption: TypeAlias = Annotated[
    bool | None,
    typer.Option(
        "--local-connectors/--no-local-connectors",
        help="Run code of the folder `connectors/` beside the YAML file; without a word from a terminal only.",
        show_default=False,
    ),
]


def resolver_beside(config: Path, is_wanted: bool | None) -> ConnectorResolver:
    """The connector types that are installed, and those beside ``config``. ``is_wanted``: what the option says."""
    from mosaic_core.runtime.configuration.local_connectors import connectors_beside
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    return ConnectorResolver(local=connectors_beside(config, refusal=_refusal(is_wanted)))


def _refusal(is_wanted: bool | None) -> str:
    if is_wanted is False:
        return "--no-local-connectors says so"
    has_terminal = sys.stdin is not None and sys.stdin.isatty()
    return "" if is_wanted or has_terminal else "no terminal started it, and no --local-connectors"
