"""Refuses what is no picture, with the line of the code that sends it. Loads neither numpy nor PyAV: where they are not
loaded, nothing is of theirs."""

from __future__ import annotations

import math
import sys
from typing import Any

from mosaic_core.contract.declared.code_lines import caller
from mosaic_core.contract.declared.wrong_declaration import wrong_message
from mosaic_core.contract.declared.yielded import kind_of

TAKEN = "a picture is uint8 (height, width, 3) in BGR order, or (height, width) for gray"
_OF_THE_WALL_S = 1e9
"""No machine has run for thirty years. A wall clock that was never set, as on a board without a battery, may be as
young as the monotonic one: the two are not compared."""
_OTHERS = "A `Captured`, an `av.VideoFrame` or an `av.Packet` is taken, too."


def check_picture(handler: type, image: object) -> None:
    """Raise :class:`MosaicError` (``plugin.wrong_message``) for what no operator could see."""
    if _is_of("av", ("VideoFrame", "Packet"), image) or (cure := picture_cure(image)) is None:
        return
    raise wrong_message(handler.__qualname__, caller(), f"sends {kind_of(image)}; {TAKEN}. {cure}", cure)


def check_stamp(handler: type, captured_at_s: float) -> None:
    """Raise :class:`MosaicError` (``plugin.wrong_message``) for what is no time of the robot's monotonic clock: its
    pictures would have a false age, on which commands may be gated."""
    if math.isfinite(captured_at_s) and captured_at_s < _OF_THE_WALL_S:
        return
    told = "no finite number" if not math.isfinite(captured_at_s) else "a time of the wall clock"
    cure = "Take it from `self.monotonic_s()`, or leave out the `Captured`: the picture is of now then."
    raise wrong_message(handler.__qualname__, caller(), f"says captured_at_s={captured_at_s:.3f}, {told}. {cure}", cure)


def picture_cure(image: Any) -> str | None:
    """What to do about an array that is no picture, and about anything else; ``None``: it is one."""
    if not _is_of("numpy", ("ndarray",), image):
        return _OTHERS
    shape: tuple[int, ...] = image.shape
    if str(image.dtype) != "uint8":
        return "Scale its numbers to 0 … 255, and let them be `.astype(np.uint8)`."
    if len(shape) == 3 and shape[2] == 4:
        return "Leave out the fourth channel: `picture[..., :3]`."
    if len(shape) == 3 and shape[2] == 1:
        return "Leave out the last axis: `picture[..., 0]`."
    if len(shape) == 3 and shape[0] == 3 != shape[2]:
        return "Put the channels last: `picture.transpose(1, 2, 0)`."
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] != 3):
        return "Give it three channels, or none."
    return "It needs at least 2 x 2 pixels." if min(shape[:2]) < 2 else None


def _is_of(module: str, names: tuple[str, ...], value: object) -> bool:
    """Whether it is an instance of one of these classes. What another thread is still loading has none."""
    loaded = sys.modules.get(module)
    kinds = (getattr(loaded, name, None) for name in names)
    return isinstance(value, tuple(kind for kind in kinds if kind is not None))
