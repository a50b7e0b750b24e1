"""Says which import an author of a plugin probably meant by one that fails."""

from __future__ import annotations

import re
import sys
from importlib import import_module

from mosaic_core.words.errors import nearest

_MISSING = re.compile(r"cannot import name '(\w+)' from '([\w.]+)'")
"""Python's own words; before 3.12 the name stands nowhere else."""
_CORE = "mosaic_core"
_PUBLIC = ("messages", "testing", "operator")
"""The modules of ours in which authors find names, beside the package itself."""


def import_meant(error: BaseException) -> str:
    """The end of the words about an import that fails: what is there instead, if anything is similar."""
    if isinstance(error, ModuleNotFoundError):
        tail = (error.name or "").removeprefix(f"{_CORE}.")
        meant = nearest(tail, _PUBLIC) if tail != error.name else None
        return f"; did you mean '{_CORE}.{meant}'?" if meant else ""
    found = _MISSING.search(str(error)) if isinstance(error, ImportError) else None
    return _name_meant(found[1], found[2]) if found else ""


def _name_meant(name: str, module: str) -> str:
    known = {place: _names_of(place) for place in _places_beside(module)}
    exact = next((place for place, names in known.items() if name in names), None)
    for place in known if exact is None else [exact]:
        meant = nearest(name, known[place])
        if meant is not None:
            return f"; did you mean '{meant}'?" if place == module else f"; did you mean `from {place} import {meant}`?"
    return ""


def _places_beside(module: str) -> tuple[str, ...]:
    """Where a name may be meant to be that ``module`` does not have. Of ours, authors find names in the public ones."""
    tail = module.removeprefix(_CORE).removeprefix(".")
    if not f"{module}.".startswith(f"{_CORE}."):
        return (module,)
    return tuple(dict.fromkeys((*([module] if tail in ("", *_PUBLIC) else []), _CORE, f"{_CORE}.messages")))


def _names_of(module: str) -> list[str]:
    loaded = import_module(module) if module.startswith(_CORE) else sys.modules.get(module)
    return getattr(loaded, "__all__", None) or [one for one in dir(loaded) if not one.startswith("_")]
