"""`python impaired_robot.py CONFIG PROFILE`: `mosaic run` behind a bad network."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any

from mosaic_core.adapters.peers import aiortc_answerer as adapter
from mosaic_core.cli.robot.run_command import run_robot
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath

if __name__ == "__main__":
    with ImpairedPath(sys.argv[2]) as path:
        answerer = adapter.AiortcAnswerer

        def behind_path(*given: Any, **words: Any) -> Any:
            return impaired(partial(answerer, **words), path)(*given)

        # The composition root takes its answerer from here.
        adapter.AiortcAnswerer = behind_path  # type: ignore[assignment, misc]
        run_robot(Path(sys.argv[1]), as_json=True, log_format=LogFormat.TEXT, log_level=LogLevel.WARNING)
