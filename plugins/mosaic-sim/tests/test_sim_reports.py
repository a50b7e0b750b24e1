"""The simulated robot's map, way, marks, mast and health."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core import Shared
from mosaic_core.testing import build, collect, fake_host, feed
from mosaic_sim.live_world import shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.reports.floor_map import SimMapConfigurer, SimPathConfigurer
from mosaic_sim.reports.floor_plan import CELL_M, WAY_ROOM_M, FloorPlan
from mosaic_sim.reports.health import SimHealthConfigurer, reports
from mosaic_sim.reports.marks import SimMarksConfigurer, SimMarksParams, boxes_in_sight
from mosaic_sim.reports.mast import RANGES_RAD, SPEED_RADPS, Mast, SimMastConfigurer, SimMastTargetConfigurer
from mosaic_sim.room import Post, courtyard

ROOM = courtyard()
PLAN = FloorPlan(ROOM)
CAMERA = SimMarksParams.model_validate({"camera": "front"})


def sent_by(handler: Any, count: int) -> list[Any]:
    """The next messages as an operator reads them."""
    collect(handler, count)
    return fake_host(handler).sent_values()[-count:]


def test_a_cell_is_taken_where_something_stands() -> None:
    for solid in ROOM.solids:
        if isinstance(solid, Post) and solid.radius_m > CELL_M:
            column, row = PLAN.cell_of(solid.x_m, solid.y_m)
            assert PLAN.occupied[row, column]
    column, row = PLAN.cell_of(*ROOM.dock)
    assert not PLAN.occupied[row, column]
    assert 0.02 < PLAN.occupied.mean() < 0.2


@given(st.floats(-5.5, 5.5), st.floats(-4.0, 4.0))
@settings(max_examples=15, deadline=None)
def test_a_way_leads_from_cell_to_cell_with_room_for_the_robot(x_m: float, y_m: float) -> None:
    way = PLAN.way((x_m, y_m), ROOM.dock)
    column, row = PLAN.cell_of(x_m, y_m)
    if PLAN.clearance_m[row, column] > WAY_ROOM_M:
        assert way[0] == PLAN.middle_of((column, row))
        assert math.dist(way[-1], ROOM.dock) < CELL_M
    for here, there in pairwise(way):
        assert math.dist(here, there) < 1.5 * CELL_M
        column, row = PLAN.cell_of(*there)
        assert PLAN.clearance_m[row, column] > WAY_ROOM_M or there == way[-1]


def test_the_map_and_the_way_lie_in_one_frame() -> None:
    shared = Shared()
    (grid,) = sent_by(build(SimMapConfigurer, shared=shared), count=1)
    assert (grid["width"], grid["height"]) == (PLAN.columns, PLAN.rows)
    assert sum(cell == 100 for cell in grid["data"]) == int(PLAN.occupied.sum())
    (path,) = sent_by(build(SimPathConfigurer, shared=shared), count=1)
    motion = shared_world(shared, 1).state.motion
    start, goal = (pose["position"] for pose in (path["poses"][0], path["poses"][-1]))
    assert math.dist((start["x"], start["y"]), (motion.x_m, motion.y_m)) < CELL_M
    assert math.dist((goal["x"], goal["y"]), ROOM.dock) < CELL_M
    assert "frame_id" not in grid and "frame_id" not in path  # noqa: PT018 - both: the world's own


def test_a_barrel_ahead_is_marked_in_the_middle_and_nothing_behind_the_robot_is() -> None:
    barrel = next(one for one in ROOM.solids if isinstance(one, Post) and not one.is_tall and one.radius_m > 0.2)
    looks = Motion(x_m=barrel.x_m - 1.0, y_m=barrel.y_m, yaw_rad=0.0)
    (box,) = [one for one in boxes_in_sight(ROOM, looks, CAMERA) if abs(one.x + one.width / 2 - 320) < 1]
    assert box.label == "barrel"
    assert box.y + box.height > 240  # it stands on the floor
    away = Motion(x_m=barrel.x_m - 1.0, y_m=barrel.y_m, yaw_rad=math.pi)
    assert all(one.height < box.height for one in boxes_in_sight(ROOM, away, CAMERA))


def test_marks_say_of_which_camera_and_which_moment_they_are() -> None:
    marks = build(SimMarksConfigurer, params={"camera": "front"})
    (message,) = sent_by(marks, count=1)
    assert (message["camera"], message["width"], message["height"]) == ("front", 640, 480)
    assert message["captured_at_us"] <= fake_host(marks).monotonic_s() * 1e6


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.none() | st.floats(0.1, 5), st.floats(0, 2))))
def test_the_mast_never_leaves_its_range_nor_turns_faster_than_it_can(steps: list[Any]) -> None:
    mast, now_s = Mast(), 0.0
    before, _ = mast.look(now_s)
    for pan, tilt, duration_s, passed_s in steps:
        mast.aim({"mast_pan": pan, "mast_tilt": tilt}, duration_s, now_s)
        now_s += passed_s
        after, velocities = mast.look(now_s)
        for name, (low, high) in RANGES_RAD.items():
            assert low <= after[name] <= high
            assert abs(after[name] - before[name]) <= SPEED_RADPS * passed_s + 1e-9
            assert abs(velocities[name]) <= SPEED_RADPS
        before = after


def test_the_mast_turns_where_it_is_told_and_halts_when_it_must() -> None:
    shared = Shared()
    target, mast = build(SimMastTargetConfigurer, shared=shared), build(SimMastConfigurer, shared=shared)
    fake_host(target).clock = fake_host(mast).clock
    refused = feed(target, [{"names": ["mast_pan"], "positions": [1.5]}, {"names": ["arm"], "positions": [0]}]).refused
    assert [one.code for one in refused] == ["safety.out_of_range"]
    first, *_, last = sent_by(mast, count=30)
    assert (first["names"], first["positions"]) == (["mast_pan", "mast_tilt"], [0.0, 0.0])
    assert last["positions"] == [1.5, 0.0]
    feed(target, [{"names": ["mast_pan"], "positions": [-1.5]}])
    target.make_safe("safety.stopped")
    assert sent_by(mast, count=1)[0]["velocities"] == [0.0, 0.0]


@pytest.mark.parametrize(("percent", "level"), [(90.0, "ok"), (20.0, "warn"), (5.0, "error")])
def test_the_battery_is_reported_as_it_is(percent: float, level: str) -> None:
    state = shared_world(Shared(), 1).state
    battery = replace(state.battery, percent=percent)
    parts = {one.name: one.level for one in reports(replace(state, battery=battery))}
    assert parts == {"battery": level, "bumper": "ok", "motors": "ok"}
    assert len(sent_by(build(SimHealthConfigurer), count=3)) == 3
