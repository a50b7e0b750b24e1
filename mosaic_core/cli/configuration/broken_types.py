"""Finds out which installed connector types can't be used, if wanted by importing them in processes of their own.

`mosaic connectors list` itself imports none: whatever an import does, ends or never ends, it does to a process that is
thrown away.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Mapping
from traceback import FrameSummary
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

PATIENCE_S = 10.0
"""For one type; the largest libraries take as long on a small computer that has just been started."""
_FRAME = re.compile(r'^  File "(?P<file>[^"]+)", line (?P<line>\d+)', re.MULTILINE)
"""Of what faulthandler writes, the innermost line first."""


def broken_types(resolver: ConnectorResolver, *, imports: bool) -> Mapping[str, str]:
    """Why each type can't be used that can't: two distributions have it or, where ``imports`` are wanted, its import
    fails. Code beside a configuration is not run for this."""
    from mosaic_core.words.errors import MosaicError

    found: dict[str, str] = {}
    waiting: list[str] = []
    for name in dict.fromkeys(one.type for one in resolver.types()):
        try:
            local = resolver.find(name).local
            if local is None:
                waiting.append(name)
            elif local.unreadable is not None:
                found[name] = f"{local.unreadable.file}:{local.unreadable.line}: {local.unreadable.message}"
        except MosaicError as error:
            found[name] = error.message
    return {**found, **(_imported(waiting) if imports else {})}


def _imported(names: list[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    while names:
        told, how = _told_by_a_process(names)
        found |= {name: cause for name, cause in told if cause}
        names = names[len(told) :]
        if names:  # the first of them ended the process
            found[names[0]] = how
            names = names[1:]
    return found


def _told_by_a_process(names: list[str]) -> tuple[list[tuple[str, str]], str]:
    """What a process tells of types, in their order, and how it ended."""
    paths = os.pathsep.join(path for path in sys.path if path)
    command = [sys.executable, "-P", "-m", __name__]
    environment, wish = {**os.environ, "PYTHONPATH": paths}, json.dumps([PATIENCE_S, names])
    done = subprocess.run(command, input=wish, env=environment, capture_output=True, text=True)
    return [tuple(json.loads(line)) for line in done.stdout.splitlines()], _how_it_ended(done)


def _how_it_ended(done: subprocess.CompletedProcess[str]) -> str:
    from mosaic_core.runtime.threads.code_places import innermost_own

    frames = [FrameSummary(match["file"], int(match["line"]), "") for match in _FRAME.finditer(done.stderr)]
    at = innermost_own(reversed(frames)).in_brackets
    if "Timeout" in done.stderr:
        return f"its import had not ended after {PATIENCE_S:g} s{at}"
    how = signal.Signals(-done.returncode).name if done.returncode < 0 else f"exit code {done.returncode}"
    return f"its import ends the whole process: {how}{at}"


# -- the process that is thrown away -----------------------------------------------------------------------------------


def main() -> None:
    """Import the types that stdin names, each within so many seconds, and tell of it on stdout: ``[type, cause]``."""
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    out, trouble = os.fdopen(os.dup(1), "w"), os.fdopen(os.dup(2), "w")
    patience_s, names = json.load(sys.stdin)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):  # what plugins print, or ask, is not told
        os.dup2(nowhere, descriptor)
    faulthandler.enable(trouble)
    resolver = ConnectorResolver()
    for name in names:
        faulthandler.dump_traceback_later(patience_s, exit=True, file=trouble)
        print(json.dumps([name, _cause(resolver, name)]), file=out, flush=True)
    os._exit(0)  # threads that an import began need not end


def _cause(resolver: ConnectorResolver, name: str) -> str:
    from mosaic_core.runtime.threads.code_places import explained_error
    from mosaic_core.words.errors import MosaicError

    try:
        resolver.resolve(name)
    except MosaicError as error:
        return error.message.partition(" can't be used: ")[2] or error.message
    except BaseException as error:  # noqa: BLE001 - an import may raise what is no Exception at all
        return explained_error(error)
    return ""


if __name__ == "__main__":
    main()
