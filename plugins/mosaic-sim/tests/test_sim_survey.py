"""The survey of the simulated robot: an answer about the room, told on the way, and taken back."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core import Request
from mosaic_core.testing import build, connector, joined
from mosaic_sim.survey import LOOK_S, SimSurveyConfigurer, SurveyOrder


def test_a_look_around_tells_how_near_the_next_thing_is() -> None:
    told: list[Any] = []
    report = build(SimSurveyConfigurer).answer(SurveyOrder(duration_s=0), Request(told=told.append))
    assert (report.looks, told) == (1, [{"percent": 100.0}])
    assert 0.0 < report.nearest_m < 10.0
    assert report.free_area_m2 > report.nearest_m**2


def test_a_survey_that_is_taken_back_looks_no_more() -> None:
    request = Request()
    request.cancel()
    assert build(SimSurveyConfigurer).answer(SurveyOrder(duration_s=20), request).looks == 1


async def test_an_operator_is_told_how_far_it_is() -> None:
    told: list[Any] = []
    async with joined(connector(SimSurveyConfigurer, label="survey")) as link:
        report = await link.connection.request("survey", {"duration_s": LOOK_S}, on_progress=told.append)
    assert report["looks"] == 2
    assert told[0]["percent"] == pytest.approx(50.0)
