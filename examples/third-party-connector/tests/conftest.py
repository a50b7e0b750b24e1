"""Lets the tests run from a checkout too, where the distribution isn't installed."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
