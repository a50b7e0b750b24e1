"""The pages about machines: their service file is one, and the doctor leads to pages that exist and know its codes."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mosaic_core.machines.diagnosis.board_verdicts import Board

HOWTO = Path(__file__).parents[2] / "docs" / "howto"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_has_nothing_against_the_service_file_of_the_page(tmp_path: Path) -> None:
    [text] = re.findall(r"```ini\n(.*?)```", (HOWTO / "service.md").read_text(), re.DOTALL)
    unit = tmp_path / "robot.service"
    unit.write_text(text)
    done = subprocess.run(["systemd-analyze", "verify", str(unit)], capture_output=True, text=True, timeout=20)
    assert (done.returncode, done.stderr.strip()) == (0, "")


@pytest.mark.parametrize("model", ["Raspberry Pi 5 Model B", "NVIDIA Jetson AGX Orin", "NUC", ""])
def test_the_page_of_a_board_exists_and_leads_to_service_and_doctor(model: str) -> None:
    text = (HOWTO.parents[1] / Board(model).page).read_text()
    assert "(service.md)" in text
    assert "mosaic doctor encoders" in text
    assert "mosaic doctor --only machine" in text
