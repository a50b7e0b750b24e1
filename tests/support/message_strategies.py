"""One Hypothesis strategy for each standard message: valid ones, with and without what may be absent."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from mosaic_core import messages as m

numbers = st.floats(-1e6, 1e6)
counts = st.integers(0, 10**15)
texts = st.text(max_size=20)
times = st.none() | counts
frames = st.none() | texts
vectors = st.fixed_dictionaries({"x": numbers, "y": numbers, "z": numbers})


@st.composite
def rotations(draw: st.DrawFn) -> m.Quaternion:
    return m.Quaternion.of_yaw(draw(st.floats(-math.pi, math.pi)))


@st.composite
def joints(draw: st.DrawFn, kind: type[m.StandardMessage], *lists: str) -> m.StandardMessage:
    names = draw(st.lists(texts, max_size=5, unique=True))
    values = {one: draw(st.lists(numbers, min_size=len(names), max_size=len(names))) for one in lists}
    return kind.model_validate({"names": names, **values})


@st.composite
def scans(draw: st.DrawFn) -> m.LaserScan:
    ranges = draw(st.lists(st.none() | st.floats(0, 100), max_size=20))
    increment_rad = draw(st.floats(0.001, 0.1))
    return m.LaserScan(
        angle_min=-1.0,
        angle_max=-1.0 + max(0, len(ranges) - 1) * increment_rad,
        angle_increment=increment_rad,
        range_max=100.0,
        ranges=ranges,
        intensities=draw(st.just([]) | st.lists(numbers, min_size=len(ranges), max_size=len(ranges))),
        frame_id=draw(frames),
        timestamp=draw(times),
    )


@st.composite
def sticks(draw: st.DrawFn) -> m.Joy:
    axes, buttons = draw(st.lists(st.floats(-1, 1), max_size=8)), draw(st.lists(st.integers(0, 1), max_size=8))
    return m.Joy(
        axes=axes,
        buttons=buttons,
        axis_names=draw(st.just([]) | st.lists(texts, min_size=len(axes), max_size=len(axes))),
        button_names=draw(st.just([]) | st.lists(texts, min_size=len(buttons), max_size=len(buttons))),
        frame_id=draw(frames),
        timestamp=draw(times),
    )


@st.composite
def grids(draw: st.DrawFn) -> m.OccupancyGrid:
    width, height = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    data = draw(st.lists(st.integers(-1, 100), min_size=width * height, max_size=width * height))
    return m.OccupancyGrid(resolution=0.05, width=width, height=height, origin=draw(poses), data=data)


points = st.builds(m.Point, x=numbers, y=numbers, z=numbers)
linear = vectors.map(m.LinearVelocity.model_validate)
angular = vectors.map(m.AngularVelocity.model_validate)
twists = st.builds(m.Twist, linear=linear, angular=angular)
poses = st.builds(m.Pose, position=points, orientation=rotations(), frame_id=frames, timestamp=times)
marks = st.builds(m.ImagePoint, x=numbers, y=numbers)

STRATEGIES: dict[type[m.StandardMessage], st.SearchStrategy[Any]] = {
    m.Twist: twists,
    m.Pose: poses,
    m.Odometry: st.builds(
        m.Odometry, position=points, orientation=rotations(), twist=twists, child_frame_id=frames, timestamp=times
    ),
    m.Transform: st.builds(
        m.Transform, frame_id=st.just("map"), child_frame_id=st.just("odom"), translation=points, rotation=rotations()
    ),
    m.Path: st.builds(m.Path, poses=st.lists(poses, max_size=4), frame_id=frames),
    m.OccupancyGrid: grids(),
    m.JointState: joints(m.JointState, "positions", "velocities"),
    m.JointTarget: joints(m.JointTarget, "positions"),
    m.GripperTarget: st.builds(m.GripperTarget, position=st.floats(0, 1), max_effort=st.none() | st.floats(0, 100)),
    m.Imu: st.builds(
        m.Imu,
        angular_velocity=angular,
        linear_acceleration=vectors.map(m.LinearAcceleration.model_validate),
        orientation=st.none() | rotations(),
    ),
    m.GpsFix: st.builds(
        m.GpsFix,
        latitude=st.floats(-90, 90),
        longitude=st.floats(-180, 180),
        altitude=st.none() | numbers,
        satellites=st.none() | st.integers(0, 100),
        course_rad=st.none() | numbers,
    ),
    m.LaserScan: scans(),
    m.Range: st.builds(
        m.Range, range=st.none() | numbers, range_max=numbers, radiation=st.sampled_from([None, "radar"])
    ),
    m.Joy: sticks(),
    m.Temperature: st.builds(m.Temperature, temperature_c=st.floats(-270, 1e4), timestamp=times),
    m.BatteryState: st.builds(
        m.BatteryState,
        percent=st.none() | st.floats(0, 100),
        voltage_v=st.none() | numbers,
        charging=st.none() | st.booleans(),
    ),
    m.ImageAnnotations: st.builds(
        m.ImageAnnotations,
        camera=frames,
        boxes=st.lists(
            st.builds(m.ImageBox, x=numbers, y=numbers, width=counts, height=counts, label=frames), max_size=3
        ),
        lines=st.lists(st.builds(m.ImageLine, points=st.lists(marks, min_size=1, max_size=3)), max_size=3),
        texts=st.lists(st.builds(m.ImageText, x=numbers, y=numbers, text=texts, color=st.just("#ff8800")), max_size=3),
    ),
    m.Log: st.builds(m.Log, level=st.sampled_from(["debug", "fatal"]), message=texts, name=frames, timestamp=times),
    m.Diagnostic: st.builds(
        m.Diagnostic,
        level=st.just("stale"),
        name=texts,
        message=texts,
        values=st.dictionaries(texts, texts, max_size=3),
    ),
}
