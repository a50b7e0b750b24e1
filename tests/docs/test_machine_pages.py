"""The pages about machines: whatever they name is known to the code, and the doctor leads to them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from mosaic_core.adapters.video.encoder_choice import KINDS
from mosaic_core.cli.robot.service_unit import ServiceUnit, unit_text
from mosaic_core.doctor.encoder_checks import CODECS, taken_sentence
from mosaic_core.doctor.plan import Plan, Subject
from mosaic_core.machines.diagnosis.board_verdicts import Board
from mosaic_core.words.codes import REASONS

HOWTO = Path(__file__).parents[2] / "docs" / "howto"
BOARDS = {"raspberry-pi": "Raspberry Pi 5 Model B", "jetson": "NVIDIA Jetson AGX Orin", "x86": "NUC"}
TEXTS = {name: (HOWTO / f"{name}.md").read_text() for name in (*BOARDS, "service")}
BY_NAME = {kind.name: kind for kind in KINDS}
SOFTWARE = {kind.codec: kind for kind in KINDS if not kind.is_hardware}
SAYS_TAKEN = re.compile(r"\b(H\.264|VP8) by `(\w+)`(?! (?:for|is for) operators)")
OF_OTHERS = {"nvv4l2h264enc", "x264enc", "h264parse"}
"""Elements of GStreamer."""


def service_file() -> str:
    [text] = re.findall(r"```ini\n(.*?)```", TEXTS["service"], re.DOTALL)
    return str(text)


def test_the_service_file_of_the_page_is_what_the_command_prints() -> None:
    command = ("/bin/true", "run", "/home/rover/mosaic_config.yaml")
    facts = ServiceUnit(
        "mosaic", "daemon", ("video", "dialout"), Path("/"), command, Path("/etc/mosaic"), credentials=("token",)
    )
    printed = [line for line in unit_text(facts).splitlines() if line and not line.startswith("#")]
    assert [line for line in service_file().splitlines() if line] == printed


def test_the_places_of_the_service_page_are_those_that_the_command_names() -> None:
    facts = ServiceUnit("mosaic", "daemon", (), Path("/"), ("/bin/true",), Path("/etc/mosaic"), credentials=("token",))
    of_user = ServiceUnit("mosaic", "", (), Path("/"), ("/bin/true",), Path("/etc/mosaic"))
    for place in ("/etc/systemd/system", "/etc/mosaic/token", "systemctl daemon-reload"):
        assert place in TEXTS["service"]
        assert place in unit_text(facts)
    assert "~/.config/systemd/user" in TEXTS["service"]
    assert "~/.config/systemd/user" in unit_text(of_user)


@pytest.mark.parametrize("model", [*BOARDS.values(), ""])
def test_the_page_of_a_board_exists_and_leads_to_service_and_doctor(model: str) -> None:
    text = (HOWTO.parents[1] / Board(model).page).read_text()
    assert "(service.md)" in text
    assert "mosaic doctor encoders" in text
    assert "mosaic doctor --only machine" in text


@pytest.mark.parametrize("page", TEXTS)
async def test_every_code_group_and_encoder_of_a_page_is_one_that_the_code_has(page: str) -> None:
    text = TEXTS[page]
    assert set(re.findall(r"`((?:check|signal|media|config)\.\w+)`", text)) <= REASONS.keys()
    assert set(re.findall(r"doctor[^`\n]*--only (\w+)", text)) <= set(Plan(Subject()).groups)
    named = set(re.findall(r"\b(?:\w+264\w*|lib[vx]\w*p[x8]\w*|vp8_\w+)\b", text)) - {"H264", "x264", "vp8"}
    assert named - OF_OTHERS <= BY_NAME.keys()


def rows_of_encoders() -> Iterator[tuple[str, str, str]]:
    for page in BOARDS:
        section = TEXTS[page].split("## Encoders")[1].split("\n## ")[0]
        for codec, name in SAYS_TAKEN.findall("\n".join(re.findall(r"^\|.*", section, re.MULTILINE))):
            yield page, codec, name


@pytest.mark.parametrize(("page", "codec", "name"), list(rows_of_encoders()))
def test_where_this_encoder_works_the_doctor_says_what_the_page_says_and_leads_to_it(
    page: str, codec: str, name: str
) -> None:
    kind = BY_NAME[name]
    said = taken_sentence({**SOFTWARE, kind.codec: kind}, Board(BOARDS[page]))
    assert said.startswith(f"Cameras are sent as {codec.replace('.', '')} by {name} in ")
    assert said.endswith(f"see docs/howto/{page}.md.")


def test_each_page_says_what_is_taken_without_hardware() -> None:
    assert {page for page, codec, name in rows_of_encoders() if (codec, name) == ("VP8", "libvpx")} == set(BOARDS)


def test_the_order_on_the_page_is_the_order_of_the_choice() -> None:
    [order] = re.findall(r"first in this order:(.*?)\. A GPU", TEXTS["x86"], re.DOTALL)
    assert re.findall(r"`(\w+)`", order) == [kind.name for kind in KINDS if kind.codec == "H264"]


def test_where_vp8_is_in_hardware_too_it_is_taken_as_the_page_says() -> None:
    both = {kind.codec: kind for kind in (BY_NAME["h264_vaapi"], BY_NAME["vp8_vaapi"])}
    assert "sent as VP8 by vp8_vaapi in hardware" in taken_sentence(both, Board(""))


def test_with_one_codec_alone_that_one_is_taken() -> None:
    for codec in CODECS:
        assert f"sent as {codec} by {SOFTWARE[codec].name}" in taken_sentence({codec: SOFTWARE[codec]}, Board(""))
