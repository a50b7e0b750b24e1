"""``python -m mosaic_sim.demo.trial_program TYPE …``: the params with which connectors run on any machine.

Imports their plugins, which is why it is a process of its own. Prints one JSON object: by type, for those that have a
``trial`` and can be imported. What can't be is told by the check of the robot's file.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from typing import Any

from mosaic_core import MosaicError
from mosaic_core.cli.terminal.threads_left import ended_without_threads
from mosaic_core.runtime.configuration.resolver import ConnectorResolver


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


if __name__ == "__main__":
    with ended_without_threads():
        print(json.dumps(trials_of(sys.argv[1:]), default=str))
