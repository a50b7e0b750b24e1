"""Converts what is marked in pictures, both ways, as ``foxglove_msgs`` has it: lines and words, and no boxes.

A box goes out as a closed line of four points and its label as words; upright rectangles come back as boxes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from mosaic_core.messages import ImageAnnotations, ImageBox, ImageLine, ImagePoint, ImageText
from mosaic_ros2.conversion.parts import MAX_NAME, Origin, Ros, ros_stamp, stamp_us

POINTS, LINE_LOOP, LINE_STRIP, LINE_LIST = 1, 2, 3, 4
"""foxglove_msgs/PointsAnnotation."""
CIRCLE_CORNERS = 24
THICKNESS_PX, FONT_PX = 2.0, 14.0
COLOR = "#00e676"
"""Where nobody chose one."""


def annotations(message: Ros) -> Iterable[ImageAnnotations]:
    """Circles become closed lines."""
    boxes: list[ImageBox] = []
    lines = [_circle(one) for one in message["circles"]]
    for one in message["points"]:
        for line in _lines(one):
            box = _box(line)
            if box is None:
                lines.append(line)
            else:
                boxes.append(box)
    texts = [
        ImageText(**_place(one["position"]), text=one["text"][:MAX_NAME], color=_color(one["text_color"]))
        for one in message["texts"]
    ]
    every = (*message["circles"], *message["points"], *message["texts"])
    stamp = stamp_us(every[0]["timestamp"]) if every else None
    yield ImageAnnotations(boxes=boxes, lines=lines, texts=texts, timestamp=stamp)


def annotations_fields(message: ImageAnnotations, origin: Origin) -> Ros:
    """A ``foxglove_msgs/ImageAnnotations``. Which camera they belong to, its topic says."""
    stamp = ros_stamp(message.timestamp or origin.stamp_us)
    loops = [(_corners(box), True, box.color) for box in message.boxes]
    lines = [([_xy(one) for one in line.points], line.closed, line.color) for line in message.lines]
    words = [*_labels(message.boxes), *message.texts]
    return {
        "points": [_ros_line(stamp, *one) for one in (*loops, *lines)],
        "texts": [_ros_text(stamp, one) for one in words],
    }


def _lines(message: Ros) -> Iterator[ImageLine]:
    """The lines of a points annotation; a point alone is a line of one."""
    found, kind = [ImagePoint(**_place(one)) for one in message["points"]], message["type"]
    color = _color(message["outline_color"])
    step = {POINTS: 1, LINE_LIST: 2}.get(kind, len(found))
    for at in range(0, len(found), max(1, step)):
        yield ImageLine(points=found[at : at + step], closed=kind == LINE_LOOP, color=color)


def _circle(message: Ros) -> ImageLine:
    x, y, radius = message["position"]["x"], message["position"]["y"], message["diameter"] / 2
    angles = [2 * math.pi * number / CIRCLE_CORNERS for number in range(CIRCLE_CORNERS)]
    around = [ImagePoint(x=x + radius * math.cos(one), y=y + radius * math.sin(one)) for one in angles]
    return ImageLine(points=around, closed=True, color=_color(message["outline_color"]))


def _box(line: ImageLine) -> ImageBox | None:
    """The box that a closed line draws, if its four corners make one."""
    if not line.closed or len(line.points) != 4:
        return None
    xs, ys = [one.x for one in line.points], [one.y for one in line.points]
    left, top = min(xs), min(ys)
    box = ImageBox(x=left, y=top, width=max(xs) - left, height=max(ys) - top, color=line.color)
    corners = [(one.x, one.y) for one in line.points]
    wanted = [(left, top), (max(xs), top), (max(xs), max(ys)), (left, max(ys))]
    return box if corners == wanted else None


def _corners(box: ImageBox) -> list[Ros]:
    right, bottom = box.x + box.width, box.y + box.height
    places = ((box.x, box.y), (right, box.y), (right, bottom), (box.x, bottom))
    return [{"x": x, "y": y} for x, y in places]


def _labels(boxes: Iterable[ImageBox]) -> Iterator[ImageText]:
    for box in boxes:
        score = "" if box.score is None else f"{box.score:.0%}"
        words = f"{box.label or ''} {score}".strip()
        if words:
            yield ImageText(x=box.x, y=box.y, text=words[:MAX_NAME], color=box.color)


def _ros_line(stamp: Ros, points: list[Ros], is_closed: bool, color: str | None) -> Ros:
    kind = LINE_LOOP if is_closed else LINE_STRIP if len(points) > 1 else POINTS
    drawn = {"outline_color": _ros_color(color), "thickness": THICKNESS_PX}
    return {"timestamp": stamp, "type": kind, "points": points, **drawn}


def _ros_text(stamp: Ros, text: ImageText) -> Ros:
    drawn = {"font_size": FONT_PX, "text_color": _ros_color(text.color)}
    return {"timestamp": stamp, "position": {"x": text.x, "y": text.y}, "text": text.text, **drawn}


def _xy(point: ImagePoint) -> Ros:
    return {"x": point.x, "y": point.y}


def _place(point: Ros) -> dict[str, float]:
    return {"x": point["x"], "y": point["y"]}


def _color(rgba: Ros) -> str | None:
    """``None`` for what can't be seen through and through."""
    if not rgba["a"] > 0:
        return None
    parts = (round(255 * min(max(rgba[one], 0.0), 1.0)) if math.isfinite(rgba[one]) else 0 for one in "rgb")
    return "#" + "".join(f"{one:02x}" for one in parts)


def _ros_color(color: str | None) -> Ros:
    text = color or COLOR
    red, green, blue = (int(text[at : at + 2], 16) / 255 for at in (1, 3, 5))
    return {"r": red, "g": green, "b": blue, "a": 1.0}
