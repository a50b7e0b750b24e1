"""How pictures shall be encoded: what a mistake in the file is told as, and what follows from what was said."""

from __future__ import annotations

from typing import get_args

import pytest

from mosaic_core import EncodingParams
from mosaic_core.adapters.video.encoder_choice import KINDS
from mosaic_core.contract.media import Encoder
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.yaml_document import parse_yaml


def problems_of(yaml: str) -> list[str]:
    document = parse_yaml(yaml, "robot.yaml", {})
    return [str(problem) for problem in validated(EncodingParams, document.tree, document, ())[1]]


def test_every_encoder_that_is_tried_can_be_named_and_its_codec_is_known() -> None:
    assert set(get_args(Encoder)) == {"auto", *(kind.name for kind in KINDS)}
    for kind in KINDS:
        assert EncodingParams.model_validate({"encoder": kind.name}).encoders_codec == kind.codec.lower()
    assert EncodingParams().encoders_codec is None


def test_a_misspelt_encoder_is_told_with_the_nearest_name() -> None:
    (problem,) = problems_of("encoder: h264_nvence")
    assert "'h264_nvence'" in problem
    assert "did you mean 'h264_nvenc'?" in problem


def test_an_encoder_of_another_codec_than_the_preferred_one_is_told() -> None:
    (problem,) = problems_of("encoder: h264_nvenc\ncodec: vp8")
    assert "encoder h264_nvenc makes h264, not vp8" in problem
    assert EncodingParams(encoder="h264_nvenc", codec="h264").encoder == "h264_nvenc"


@pytest.mark.parametrize(("most_bps", "least_bps"), [(100_000, 100_000), (150_000, 150_000), (900_000, 150_000)])
def test_a_low_maximum_lowers_the_minimum_that_nobody_wrote(most_bps: int, least_bps: int) -> None:
    assert EncodingParams(max_bitrate_bps=most_bps).least_bps == least_bps
    assert EncodingParams(max_bitrate_bps=most_bps, min_bitrate_bps=60_000).least_bps == 60_000
    assert EncodingParams().least_bps == 150_000


def test_a_minimum_above_the_maximum_is_told_to_whoever_wrote_it() -> None:
    (problem,) = problems_of("max_bitrate_bps: 100000\nmin_bitrate_bps: 150000")
    assert "max_bitrate_bps is below min_bitrate_bps" in problem
    assert problems_of("max_bitrate_bps: 100000") == []
