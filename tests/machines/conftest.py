"""Examples of properties take as long as a busy machine lets them; their time says nothing about what they prove."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("mosaic", deadline=None)
settings.load_profile("mosaic")
