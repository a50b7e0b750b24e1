"""The one exception of this plugin: a source that can't be opened or was lost, always with a cure."""

from __future__ import annotations

from mosaic_core import MosaicError


class SourceError(MosaicError):
    """A camera's source can't be opened or was lost: the runner reports it and restarts with back-off."""

    def __init__(self, message: str, cure: str) -> None:
        super().__init__(f"{message}; {cure}", code="plugin.failed", cure=cure)
