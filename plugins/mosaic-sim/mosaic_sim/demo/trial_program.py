"""``python -m mosaic_sim.demo.trial_program TYPE …``: the params with which connectors run on any machine, and the
check of a file that names them.

Imports their plugins, which is why it is a process of its own. Prints a line with one JSON object behind
:data:`TRIALS`: by type, for those that have a ``trial`` and can be imported. What can't be is told by the check: of the
file whose path comes on a line of standard input it prints last what ``mosaic validate --json`` does.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import typer

from mosaic_core import MosaicError
from mosaic_core.cli.terminal.threads_left import ended_without_threads
from mosaic_core.runtime.configuration.resolver import ConnectorResolver

TRIALS = "trials of plugins: "


def trials_of(types: Iterable[str]) -> dict[str, Any]:
    """The ``trial`` of each connector type that names one."""
    resolver, found = ConnectorResolver(), dict[str, Any]()
    for name in types:
        try:
            trial = resolver.resolve(name).trial
        except MosaicError:
            continue
        if trial is not None:
            found[name] = dict(trial)
    return found


def main() -> None:
    from mosaic_core.cli.configuration.validate_command import validate  # whoever starts this reads its words alone

    print(f"\n{TRIALS}{json.dumps(trials_of(sys.argv[1:]), default=str)}", flush=True)  # a plugin may have printed, too
    if path := sys.stdin.readline().rstrip("\n"):
        validate(Path(path), as_json_text=True)


if __name__ == "__main__":
    with ended_without_threads(), suppress(typer.Exit):
        main()
