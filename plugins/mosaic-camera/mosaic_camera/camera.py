"""`camera` and upstream's `opencv-sender-camera`: pictures of a device, a video file or a network stream.

The source lives in a ``with`` block of the body. When it vanishes the body raises, and the runner starts it again
with back-off: that is the reconnect.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, cast

from pydantic import Field, field_validator

from mosaic_camera.grabbed import Grabbed, WantedSource
from mosaic_camera.grabber import Grabber
from mosaic_camera.pattern import TestPattern, TestPatternParams
from mosaic_camera.source import is_device, may_have_packets, meant_scheme, open_source, shown
from mosaic_camera.source_error import SourceError
from mosaic_camera.transform import Flip, Rotation, scaled, turned
from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler, unit
from mosaic_core.contract.media import Image

if TYPE_CHECKING:
    import av

PATTERN = "pattern"
WAKE_S = 0.2
"""How long the body waits for a picture before it looks whether it shall stop."""
FIRST_PICTURE_S = 12.0
"""Opening may take 5 s on a network and a camera may warm up for seconds."""
SILENCE_S = 6.0
"""A running source without a picture for this long is lost, though its driver still waits."""
LOOK_AT_SOURCE = "check cable, power and network; it is tried again by itself"
LATE_S = 0.5
"""A recording that is further behind than this goes on from here instead of catching up."""


class CameraParams(EncodingParams):
    """Params of a camera."""

    source: int | str = Field(
        default="/dev/video0",
        description="Device path or number, video file, URL (rtsp://, http://, https://), or `pattern`: a picture that "
        "is made up, to try it without a camera.",
    )
    width: int | None = Field(
        default=None,
        ge=2,
        le=7680,
        description="Pixels. A device takes its nearest mode, files and streams are scaled. Default: the source's own.",
        json_schema_extra=unit("px"),
    )
    height: int | None = Field(
        default=None,
        ge=2,
        le=4320,
        description="Pixels, like `width`; with only one of both the other follows.",
        json_schema_extra=unit("px"),
    )
    fps: float | None = Field(
        default=None, gt=0, le=240, description="At most this many pictures per second.", json_schema_extra=unit("1/s")
    )
    flip: Flip = Field(default="none", description="Mirror the picture.")
    rotation: Rotation = Field(
        default=0, description="Degrees clockwise, after flipping.", json_schema_extra=unit("deg")
    )
    loop: bool = Field(default=True, description="Start a video file again when it ends.")
    passthrough: Literal["auto", "device", "never"] = Field(
        default="auto",
        description="`auto`: H.264 of network streams and files is sent as it is, where neither size, rate, flip nor "
        "rotation is asked for; operators without H.264 get it encoded anew. `device`: that of a USB camera's own "
        "encoder too, whose bit rate follows nobody's network. `never`: always encode. What exceeds `max_bitrate_bps` "
        "is encoded anew.",
    )

    @field_validator("source")
    @classmethod
    def _is_known_address(cls, source: int | str) -> int | str:
        if meant := meant_scheme(source):
            raise ValueError(f"no camera speaks {str(source).partition(':')[0]}://; did you mean {meant}://?")
        return source


class Camera(MediaTrackHandler):
    """Sends the pictures of a device, a video file or a URL to operators."""

    widget = "video"

    def __init__(self, label: str, params: CameraParams) -> None:
        super().__init__(label)
        self._params = params
        self._passes_packets = _passes_packets(params)
        self.encoding = params
        self.packet_codec = "h264" if self._passes_packets else None

    def frames(self) -> Iterator[Captured]:
        params = self._params
        wanted = WantedSource(params.source, params.width, params.height, params.fps, self._passes_packets)
        with Grabber(lambda: open_source(wanted), is_looping=params.loop, name=self.label, fps=params.fps) as grabber:
            for grabbed, captured_at_s in self._paced(grabber):
                image = cast("Image | av.Packet[Any]", grabbed.image)
                yield Captured(image if grabber.keeps_order else self._presented(cast(Image, image)), captured_at_s)

    def _paced(self, grabber: Grabber) -> Iterator[tuple[Grabbed, float]]:
        """Pictures at their time: live ones as they come, those of a recording by its time stamps."""
        began_s: float | None = None
        while (grabbed := self._next(grabber)) is not None:
            if grabber.is_live:
                yield grabbed, grabbed.captured_at_s
                continue
            began_s = self._began_s(began_s, grabbed.position_s)
            if self.pause(max(0.0, began_s + grabbed.position_s - self.monotonic_s())):
                return
            yield grabbed, self.monotonic_s()

    def _began_s(self, began_s: float | None, position_s: float) -> float:
        """When position 0 of the recording was, or would have been, shown."""
        now_s = self.monotonic_s()
        if began_s is None or now_s - (began_s + position_s) > LATE_S:
            return now_s - position_s
        return began_s

    def _next(self, grabber: Grabber) -> Grabbed | None:
        """The next picture; ``None`` when the handler shall stop or the recording is over."""
        waited_s, count = 0.0, grabber.count
        while not self.is_stopping:
            grabbed = grabber.next(WAKE_S)
            self._count_garbled(grabber)
            if grabbed is not None:
                return grabbed
            if grabber.has_ended:
                self._check_end(grabber)
                return None
            waited_s = waited_s + WAKE_S if grabber.count == count else 0.0  # one that is left out is no silence
            count = grabber.count
            limit_s = SILENCE_S if grabber.count else FIRST_PICTURE_S
            if waited_s >= limit_s:
                raise SourceError(f"no picture from {shown(self._params.source)} for {limit_s:g} s", LOOK_AT_SOURCE)
        return None

    def _count_garbled(self, grabber: Grabber) -> None:
        if garbled := grabber.take_garbled():
            self.count_loss("refused", garbled)

    def _check_end(self, grabber: Grabber) -> None:
        """A recording that is not looped may end; anything else that ends is a fault, and raises."""
        name = shown(self._params.source)
        if not grabber.count:
            raise SourceError(f"{name} gives no picture", LOOK_AT_SOURCE)
        if grabber.is_live:
            raise SourceError(f"{name} was lost", LOOK_AT_SOURCE)
        if self._params.loop:
            raise SourceError(f"{name} can't be rewound", "set `loop: false`, or convert it to MP4")

    def _presented(self, image: Image) -> Image:
        """As configured. A device was asked for the size; if it has another one, squeezing it would distort."""
        params = self._params
        if not is_device(params.source):
            image = scaled(image, params.width, params.height)
        return turned(image, params.flip, params.rotation)


def _passes_packets(params: CameraParams) -> bool:
    """Whether the source's own packets would show what is asked for."""
    if is_device(params.source):  # size and rate are modes of its own
        return params.passthrough == "device" and params.rotation == 0 and params.flip == "none"
    is_changed = any((params.width, params.height, params.fps, params.rotation, params.flip != "none"))
    return params.passthrough != "never" and not is_changed and may_have_packets(str(params.source))


class CameraConfigurer(MediaTrackConfigurer[CameraParams]):
    """A camera, a video file (looped or once), or a network stream (RTSP, HTTP)."""

    connector_type = "camera"
    trial = {"source": PATTERN}  # noqa: RUF012 - as the contract has it
    example = {"source": "/dev/video0", "width": 1280, "height": 720, "fps": 30}  # noqa: RUF012 - as the contract has it

    def configure(self) -> Camera | TestPattern:
        return made_up(self.label, self.params) if self.params.source == PATTERN else Camera(self.label, self.params)


def made_up(label: str, params: CameraParams) -> TestPattern:
    """The test pattern in place of a camera, in the size, rate and encoding that are asked for."""
    asked = params.model_dump(include={"width", "height", "fps", *EncodingParams.model_fields}, exclude_none=True)
    told = {name: value for name, value in asked.items() if name in params.model_fields_set}
    return TestPattern(label, TestPatternParams.model_validate(told))


class OpencvSenderCameraParams(EncodingParams):
    """MOSAIC's own names; numbers may be strings, as its files have them."""

    camera_id: int = Field(default=0, ge=-1, description="The N of /dev/videoN; -1: a camera that is made up.")
    width: int = Field(default=640, ge=2, le=7680, description="Pixels.", json_schema_extra=unit("px"))
    height: int = Field(default=480, ge=2, le=4320, description="Pixels.", json_schema_extra=unit("px"))
    fps: float = Field(default=30, gt=0, le=240, description="Pictures per second.", json_schema_extra=unit("1/s"))


class OpencvSenderCameraConfigurer(MediaTrackConfigurer[OpencvSenderCameraParams]):
    """A camera under the name and with the params that MOSAIC's C++ robots use."""

    connector_type = "opencv-sender-camera"
    trial = {"camera_id": -1}  # noqa: RUF012 - as the contract has it

    def configure(self) -> Camera | TestPattern:
        params = self.params
        told = EncodingParams.model_fields.keys() & params.model_fields_set
        encoding = {name: getattr(params, name) for name in told}
        size = {"width": params.width, "height": params.height, "fps": params.fps}
        if params.camera_id < 0:
            return made_up(self.label, CameraParams(source=PATTERN, **size, **encoding))
        return Camera(self.label, CameraParams(source=params.camera_id, **size, **encoding))
