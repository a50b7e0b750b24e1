"""`python impaired_robot.py CONFIG PROFILE`: `mosaic run` behind a bad network."""

from __future__ import annotations

import sys
from pathlib import Path

from mosaic_core.adapters.peers import aiortc_answerer as adapter
from mosaic_core.cli.robot.run_command import run_robot
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath

if __name__ == "__main__":
    with ImpairedPath(sys.argv[2]) as path:
        # The composition root takes its answerer from here.
        adapter.AiortcAnswerer = impaired(adapter.AiortcAnswerer, path)  # type: ignore[assignment]
        run_robot(Path(sys.argv[1]), as_json=True, log_format=LogFormat.TEXT, log_level=LogLevel.WARNING)
