"""The TypeScript types are generated from the Python models, and what is committed is current."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "dashboard" / "scripts" / "generate_protocol.py"


def test_the_generated_typescript_is_current() -> None:
    done = subprocess.run([sys.executable, str(SCRIPT), "--check"], check=False)
    assert done.returncode == 0, f"run: python {SCRIPT.relative_to(Path(__file__).parents[2])}"
