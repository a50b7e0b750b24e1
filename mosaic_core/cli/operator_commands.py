"""``mosaic operator``: quick looks at robots from a terminal."""

from __future__ import annotations

import typer

app = typer.Typer(no_args_is_help=True, help="Look at robots, and command them, from the terminal.")
