"""Keeps the modules of widgets that this server serves: those of the distributions that its administrator installed.

Nothing is uploaded. A module runs in the pages of operators with everything that they may do: whoever may install
Python packages on this machine decides which code that is, and a robot only names it by its hash.
"""

from __future__ import annotations

import gzip
import logging
from collections.abc import Iterable
from dataclasses import dataclass

from mosaic_core.runtime.widgets.widget_modules import FoundModule, installed_modules
from mosaic_core.words.catalogue import WidgetModule
from mosaic_core.words.errors import PluginError

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ShelvedModule:
    """A module as it was when the server started: later changes of its file would not fit its hash."""

    announced: WidgetModule
    content: bytes
    gzipped: bytes


class WidgetShelf:
    """The modules by their hash; ``is_open=False`` serves none and says so."""

    def __init__(self, found: Iterable[FoundModule], *, is_open: bool = True) -> None:
        self.is_open = is_open
        modules = [*found] if is_open else []
        self._by_hash = {one.announced.sha256: _shelved(one) for one in modules}
        self.offered: tuple[WidgetModule, ...] = tuple(one.announced for one in modules)

    def module(self, sha256: str) -> ShelvedModule | None:
        return self._by_hash.get(sha256)


def installed_widgets(*, is_open: bool) -> WidgetShelf:
    """What is installed here, read once; what can't be served is logged. Reads files: not on the event loop."""
    if not is_open:
        return WidgetShelf((), is_open=False)
    found: list[FoundModule] = []
    for one in installed_modules():
        if isinstance(one, PluginError):
            _log.warning("a widget is not served: %s (%s)", one.message, one.cure)
        else:
            found.append(one)
            _log.info("serves widgets of %s %s: %s", one.announced.distribution, one.announced.version, one.path)
    return WidgetShelf(found)


def _shelved(found: FoundModule) -> ShelvedModule:
    return ShelvedModule(found.announced, found.content, gzip.compress(found.content, 9, mtime=0))
