"""Finds folders that two connectors of a robot would both have to themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from mosaic_core.contract.params import OwnFolder
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.handler_problems import named_in
from mosaic_core.runtime.configuration.mistakes.choices import real_place
from mosaic_core.words.errors import Problem


def folder_problems(connectors: Sequence[CheckedConnector]) -> Iterator[Problem]:
    """Every :class:`OwnFolder` that another connector of the file has already, however it is spelt."""
    owners: dict[Path, tuple[CheckedConnector, int | None]] = {}
    for one in connectors:
        for loc, folder in named_in(one.params, OwnFolder):
            place = real_place(loc, one.document, (*one.place, "params"))
            real = Path(folder).expanduser().resolve()
            owner, line = owners.setdefault(real, (one, one.document.lines.get(place)))
            if owner is not one:
                where = f" (line {line})" if line else ""
                message = f"connector '{one.config.label}' has the folder of connector '{owner.config.label}'{where}"
                yield one.document.problem(place, f"{message}: {folder}", cure="give each a folder of its own")
