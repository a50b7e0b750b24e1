"""GStreamer's webrtcbin: what its robots in this bench are made of. VP8 with the options that GStreamer's own examples
give for low latency.
"""

from __future__ import annotations

import re
import sys
import threading
from pathlib import Path
from typing import Any

from video_bench.scene import Image

SYSTEM_PACKAGES = "/usr/lib/python3/dist-packages"
"""Where Debian keeps the Python binding; it works in a virtual environment of the same Python."""
ELEMENTS = ("webrtcbin", "nicesrc", "dtlssrtpenc", "srtpenc", "vp8enc", "rtpvp8pay", "videoconvert", "appsrc")
GATHERING_S = 3.0
FPS = 30


def why_not() -> str | None:
    """Why GStreamer cannot be measured here."""
    if not (Path(SYSTEM_PACKAGES) / "gi").exists():
        return "its Python binding is not installed: apt install python3-gi gir1.2-gst-plugins-bad-1.0"
    try:
        gst = binding()
    except (ImportError, ValueError) as error:
        return f"its Python binding does not load here: {error}"
    lacking = [name for name in ELEMENTS if gst.Gst.ElementFactory.find(name) is None]
    if lacking:
        names = "gstreamer1.0-nice gstreamer1.0-plugins-good gstreamer1.0-plugins-bad"
        return f"it has no {', '.join(lacking)}: apt install {names}"
    return None


def binding() -> Any:
    """`gi.repository` with the namespaces that are needed. Raises :class:`ImportError` or :class:`ValueError`."""
    if SYSTEM_PACKAGES not in sys.path:
        sys.path.append(SYSTEM_PACKAGES)
    import gi  # type: ignore[import-not-found,unused-ignore]

    for namespace in ("Gst", "GstApp", "GstSdp", "GstWebRTC"):
        gi.require_version(namespace, "1.0")
    from gi import repository
    from gi.repository import Gst, GstApp, GstSdp, GstWebRTC  # type: ignore[import-not-found,unused-ignore]  # noqa: F401

    Gst.init(None)
    return repository


def encoded(size: tuple[int, int], bitrate_bps: int, payload_type: str) -> str:
    """From the element ``source``, which takes BGR pictures, to RTP packets."""
    width, height = size
    return (
        "appsrc name=source is-live=true do-timestamp=true format=time leaky-type=downstream max-buffers=1 "
        f"caps=video/x-raw,format=BGR,width={width},height={height},framerate={FPS}/1 "
        "! videoconvert ! video/x-raw,format=I420 "
        f"! vp8enc deadline=1 cpu-used=8 end-usage=cbr target-bitrate={bitrate_bps} lag-in-frames=0 threads=1 "
        "keyframe-max-dist=2000 error-resilient=default "
        f"! rtpvp8pay pt={payload_type} picture-id-mode=2"
    )


def sent(payload_type: str, peer: str) -> str:
    """From RTP packets to the webrtcbin ``peer``."""
    return (
        f"application/x-rtp,media=video,encoding-name=VP8,payload={payload_type} "
        f"! webrtcbin name={peer} bundle-policy=max-bundle latency=0"
    )


def vp8_of(offer_sdp: str) -> str:
    """The payload type that the offer has for VP8."""
    found = re.search(r"a=rtpmap:(\d+) VP8/90000", offer_sdp)
    if found is None:
        raise ValueError("the offer has no VP8")
    return found[1]


def answered(gi: Any, peer: Any, offer_sdp: str) -> str:
    """The answer of a webrtcbin whose pipeline plays, with its candidates. Blocks."""
    _, message = gi.GstSdp.SDPMessage.new_from_text(offer_sdp)
    offer = gi.GstWebRTC.WebRTCSessionDescription.new(gi.GstWebRTC.WebRTCSDPType.OFFER, message)
    _reply(gi, peer, "set-remote-description", offer)
    reply = _reply(gi, peer, "create-answer", None)  # the answer in it lives as long as it does
    answer = reply.get_value("answer")
    is_gathered = threading.Event()
    complete = gi.GstWebRTC.WebRTCICEGatheringState.COMPLETE

    def look(*_: object) -> None:
        if peer.get_property("ice-gathering-state") == complete:
            is_gathered.set()

    peer.connect("notify::ice-gathering-state", look)
    _reply(gi, peer, "set-local-description", answer)
    look()
    is_gathered.wait(GATHERING_S)
    return str(peer.get_property("local-description").sdp.as_text())


def push(gi: Any, source: Any, image: Image) -> None:
    source.emit("push-buffer", gi.Gst.Buffer.new_wrapped(image.tobytes()))


def _reply(gi: Any, peer: Any, signal: str, argument: Any) -> Any:
    promise = gi.Gst.Promise.new()
    peer.emit(signal, argument, promise)
    promise.wait()
    return promise.get_reply()
