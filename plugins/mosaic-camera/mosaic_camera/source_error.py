"""The one exception of this plugin: a source that can't be opened or was lost, always with a cure."""

from __future__ import annotations

from mosaic_core import DeviceGone


class SourceError(DeviceGone):
    """A camera's source can't be opened or was lost: it is looked for again."""
