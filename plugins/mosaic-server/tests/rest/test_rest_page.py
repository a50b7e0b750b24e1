"""The curl lines of the documentation, run as they stand against a real server."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[4] / "docs" / "howto" / "rest-interface.md"


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_the_lines_of_the_page_log_in_list_robots_and_prepare_a_connection(server: Any, tmp_path: Path) -> None:
    robot_id, robot_token = server.robot(server.account())
    server.connect_robot(robot_id, robot_token, {"multiPeer": 1})
    server.connect_operator(server.log_in())
    [script] = re.findall(r"^```bash\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    script = script.replace("http://127.0.0.1:9001", f"http://127.0.0.1:{server.listening.port}")
    script = re.sub(r'(?<="robotIds": \[")[^"]+', robot_id, script).replace("\ncurl", "\necho; curl")
    done = subprocess.run(["bash", "-eu", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    robots, ice_servers, made = (json.loads(line) for line in done.stdout.splitlines() if line)
    assert [robot["id"] for robot in robots["resultData"]["data"]] == [robot_id]
    assert ice_servers == []
    assert made["resultData"]["sessions"][0]["robotId"] == robot_id
    assert "/api/v1/webrtc/connection" in json.loads((tmp_path / "openapi.json").read_text())["paths"]
