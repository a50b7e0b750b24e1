"""Holds what a handler names as its keeper against what the robot listens to."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.devices.keeper import Keeper


def check_keeper(cls: type, keeper: object) -> None:
    """Refuse a ``keeper`` of a handler of ``cls`` that is none, such as the device that has one. Raises
    :class:`MosaicError` (``config.broken_plugin``)."""
    if keeper is None or isinstance(keeper, Keeper):
        return
    what = f"the class {keeper.__qualname__}" if isinstance(keeper, type) else f"a {type(keeper).__qualname__}"
    name = next(keepers_of(keeper), "")
    cure = f"Name its own: self.keeper = ….{name}" if name else "Name the Keeper that keeps its device open"
    raise wrong_declaration(cls, f"its keeper is {what}, and no Keeper.", f"{cure}, or leave it out.")


def keepers_of(thing: object) -> Iterator[str]:
    """The names under which ``thing`` itself has keepers."""
    yield from (name for name, value in getattr(thing, "__dict__", {}).items() if isinstance(value, Keeper))
