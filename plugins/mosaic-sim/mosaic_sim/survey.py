"""`sim-survey`: looks around for a while when asked, and answers how much room there is around the simulated robot."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from mosaic_core import DataChannelConfigurer, Message, Request, RequestHandler, unit
from mosaic_sim.laser_scan import scanned
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world

LOOK_S = 0.25
"""Between two looks."""
RAYS = 180
FARTHEST_M = 20.0
"""What is farther away counts as this far."""


class SurveyOrder(Message):
    duration_s: float = Field(default=3.0, ge=0, le=20, description="How long to look.", json_schema_extra=unit("s"))


class SurveyProgress(Message):
    percent: float = Field(json_schema_extra=unit("%"))


class SurveyReport(Message):
    looks: int
    nearest_m: float = Field(description="The nearest that came.", json_schema_extra=unit("m"))
    free_area_m2: float = Field(description="In sight, at the last look.", json_schema_extra=unit("m²"))


class SimSurvey(RequestHandler[SurveyOrder, SurveyReport]):
    """Moves nothing, so everybody may ask."""

    takes_observers: ClassVar[bool] = True

    def __init__(self, label: str, world: LiveWorld) -> None:
        super().__init__(label)
        self._world = world

    def answer(self, question: SurveyOrder, request: Request) -> SurveyReport:
        looks = 1 + math.ceil(question.duration_s / LOOK_S)
        nearest_m = FARTHEST_M
        for number in range(1, looks + 1):
            ranges_m, _ = scanned(self._world.world.room, self._world.state.motion, RAYS)
            seen_m = np.minimum(ranges_m, FARTHEST_M)
            nearest_m = min(nearest_m, float(seen_m.min()))
            request.progress(SurveyProgress(percent=round(100 * number / looks, 1)))
            if number < looks and request.pause(LOOK_S):
                break
        area_m2 = float(np.square(seen_m).sum()) * math.pi / RAYS
        return SurveyReport(looks=number, nearest_m=round(nearest_m, 3), free_area_m2=round(area_m2, 2))


class SimSurveyConfigurer(DataChannelConfigurer[SimParams]):
    """Answers how much room there is around the simulated robot."""

    connector_type = "sim-survey"

    def configure(self) -> SimSurvey:
        return SimSurvey(self.label, shared_world(self.shared, self.params.seed))
