"""The pages about machines: the doctor leads to pages that exist and know its codes."""

from __future__ import annotations

from pathlib import Path

import pytest

from mosaic_core.machines.diagnosis.board_verdicts import Board

HOWTO = Path(__file__).parents[2] / "docs" / "howto"


@pytest.mark.parametrize("model", ["Raspberry Pi 5 Model B", "NVIDIA Jetson AGX Orin", "NUC", ""])
def test_the_page_of_a_board_exists_and_leads_to_service_and_doctor(model: str) -> None:
    text = (HOWTO.parents[1] / Board(model).page).read_text()
    assert "(service.md)" in text
    assert "mosaic doctor encoders" in text
    assert "mosaic doctor --only machine" in text
