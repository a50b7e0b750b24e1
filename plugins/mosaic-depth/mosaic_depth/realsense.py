"""Intel RealSense cameras, and recordings of them, by Intel's library ``pyrealsense2``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from mosaic_core import DeviceGone
from mosaic_core.contract.media import Image
from mosaic_depth.depth_camera import DepthFrame, Intrinsics
from mosaic_depth.params import DepthCameraParams

RECORDINGS = (".bag", ".db3")
PLUG_IN = "plug it in, into USB 3; `rs-enumerate-devices` lists what there is"


class RealSenseCamera:
    """Depth and colour of one camera, the depth laid over the colour by the library.

    ``address``: a serial number, a recording (played over and over, in its own size and rate), or nothing.
    """

    def __init__(self, params: DepthCameraParams) -> None:
        rs = _library()
        is_recording = params.address.endswith(RECORDINGS)
        config = _of_recording(rs, params.address) if is_recording else _of_device(rs, params)
        self._align = rs.align(rs.stream.color)
        self._pipeline = rs.pipeline()
        try:
            self._pipeline.start(config)
        except RuntimeError as error:  # whatever the library has to say
            cure = f"has it {params.width}x{params.height} at {params.fps} per second? Does another program use it?"
            raise DeviceGone(f"{params.source}: {error}", cure) from error

    def next(self, timeout_s: float) -> DepthFrame | None:
        try:
            has_come, frames = self._pipeline.try_wait_for_frames(int(timeout_s * 1000))
            if not has_come:
                return None
            aligned = self._align.process(frames)
            depth, colour = aligned.get_depth_frame(), aligned.get_color_frame()
            return _depth_frame(depth, colour) if depth and colour else None
        except RuntimeError as error:
            raise OSError(str(error)) from error

    def close(self) -> None:
        try:
            self._pipeline.stop()
        except RuntimeError as error:
            raise OSError(str(error)) from error


def _library() -> Any:
    try:
        import pyrealsense2
    except ImportError as error:
        raise DeviceGone(f"pyrealsense2: {error}", "`pip install 'mosaic-depth[realsense]'`") from error
    return pyrealsense2


def _of_recording(rs: Any, path: str) -> Any:
    if not Path(path).is_file():
        raise DeviceGone(f"no recording {path}", "is the path right?")
    config = rs.config()
    config.enable_device_from_file(path, repeat_playback=True)
    return config


def _of_device(rs: Any, params: DepthCameraParams) -> Any:
    """Looks first: starting without a camera waits for one for fifteen seconds (measured)."""
    serials = [device.get_info(rs.camera_info.serial_number) for device in rs.context().query_devices()]
    if not serials:
        raise DeviceGone("no RealSense camera", PLUG_IN)
    if params.address and params.address not in serials:
        raise DeviceGone(f"no RealSense camera {params.address}, there are {', '.join(serials)}", PLUG_IN)
    config = rs.config()
    config.enable_device(params.address or serials[0])
    config.enable_stream(rs.stream.depth, params.width, params.height, rs.format.z16, params.fps)
    config.enable_stream(rs.stream.color, params.width, params.height, rs.format.bgr8, params.fps)
    return config


def _depth_frame(depth: Any, colour: Any) -> DepthFrame:
    """Copies: the library uses the memory of its frames again."""
    pinhole = colour.profile.as_video_stream_profile().intrinsics
    return DepthFrame(
        _bgr(colour),
        np.asanyarray(depth.get_data()).astype(np.float32) * np.float32(depth.get_units()),
        Intrinsics(pinhole.fx, pinhole.fy, pinhole.ppx, pinhole.ppy),
        _captured_at_s(colour),
    )


def _bgr(colour: Any) -> Image:
    """Recordings may have what the camera was asked for then."""
    pixels = np.asanyarray(colour.get_data())
    name = colour.profile.format().name
    if name not in ("bgr8", "rgb8"):
        raise DeviceGone(f"the recording has {name} colours", "record with bgr8 or rgb8")
    return np.array(pixels if name == "bgr8" else pixels[..., ::-1])


def _captured_at_s(frame: Any) -> float | None:
    """The library stamps with the wall clock, or with the camera's own, which says nothing here."""
    age_s = time.time() - frame.get_timestamp() / 1000
    return time.monotonic() - age_s if 0.0 <= age_s < 1.0 else None
