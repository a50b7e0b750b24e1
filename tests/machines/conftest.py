"""Examples of properties take as long as a busy machine lets them; their time says nothing about what they prove.
``link_film.py`` is beside the tests, not installed."""

from __future__ import annotations

import sys
from pathlib import Path

from hypothesis import settings

HERE = str(Path(__file__).parent)
if HERE not in sys.path:
    sys.path.append(HERE)

settings.register_profile("mosaic", deadline=None)
settings.load_profile("mosaic")
