"""`mosaic doctor encoders`: what works, how fast, what is missing and why."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache

import pytest
from typer.testing import CliRunner

from mosaic_core.adapters.video import encoder_choice
from mosaic_core.cli.main import app
from mosaic_core.doctor.encoder_checks import encoder_checks

ENCODERS = {"libx264", "libvpx", "h264_nvenc", "h264_v4l2m2m", "h264_vaapi"}


@pytest.fixture(scope="module", autouse=True)
def _measured_once() -> Iterator[None]:
    """An encoder that was measured for one test is as fast for the next."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encoder_choice, "measured_speed", cache(encoder_choice.measured_speed))
        yield


def test_the_table_names_every_encoder_and_what_is_used() -> None:
    done = CliRunner().invoke(app, ["doctor", "encoders"])
    assert done.exit_code == 0
    assert all(name in done.output for name in ENCODERS)
    assert "software" in done.output


def test_as_json_it_has_figures_or_a_reason_for_each() -> None:
    done = CliRunner().invoke(app, ["doctor", "encoders", "--json"])
    rows = {row["encoder"]: row for row in json.loads(done.output)}
    assert set(rows) >= ENCODERS
    for row in rows.values():
        assert row["works"] is (row["problem"] is None)
        assert row["works"] is (row["fps"] is not None)
    assert rows["libvpx"]["works"]
    assert rows["libvpx"]["fps"] > 1
    assert [row["codec"] for row in rows.values() if row["chosen"]] in (["H264", "VP8"], ["VP8", "H264"])


def test_the_last_line_says_which_encoder_cameras_take_and_where_that_is_explained() -> None:
    last = CliRunner().invoke(app, ["doctor", "encoders"]).output.strip().splitlines()[-1]
    assert re.fullmatch(r"Cameras are sent as (VP8|H264) by \w+ in .*; see docs/howto/[\w-]+\.md\.", last)


async def test_the_examination_says_it_too() -> None:
    said = {one.check: one async for one in encoder_checks()}
    assert list(said) == ["video.vp8", "video.h264", "video.taken"]
    assert said["video.taken"].sentence.startswith("Cameras are sent as ")


async def test_without_any_encoder_both_codecs_fail_and_nothing_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder_choice, "KINDS", ())
    said = [(one.check, one.code) async for one in encoder_checks()]
    assert said == [("video.vp8", "media.no_encoder"), ("video.h264", "media.no_encoder")]
    assert CliRunner().invoke(app, ["doctor", "encoders"]).exit_code == 1
