"""GStreamer's webrtcbin as an operator or a robot, with its default certificate: a program of its own, because Debian's
Python has the binding.

    /usr/bin/python3 gstreamer_peer.py operator VP8|H264 none|max-bundle LABEL...
    /usr/bin/python3 gstreamer_peer.py robot VP8|H264 none|max-bundle

The operator offers a video line and these data channels, the robot answers with a test picture. ``none`` is the bundle
policy that webrtcbin has by default.

One JSON object per line, on standard input (``answer``, ``offer``, ``candidate``, ``send``) and output (``offer``,
``answer``, ``candidate``, ``opened``, ``message``, ``picture``, ``state``, ``failed``).
"""

import json
import os
import re
import sys
import threading

import gi

for namespace in ("Gst", "GstSdp", "GstWebRTC"):
    gi.require_version(namespace, "1.0")
from gi.repository import GLib, Gst, GstSdp, GstWebRTC  # noqa: E402

ENCODERS = {
    "VP8": "vp8enc deadline=1 keyframe-max-dist=30 ! rtpvp8pay picture-id-mode=2",
    "H264": "openh264enc complexity=low gop-size=30 ! video/x-h264,profile=constrained-baseline "
    "! rtph264pay config-interval=-1 aggregate-mode=zero-latency",
}
DECODERS = {"VP8": "rtpvp8depay ! vp8dec", "H264": "rtph264depay ! h264parse ! openh264dec"}
PAYLOAD_TYPE = {"VP8": r"a=rtpmap:(\d+) VP8/90000", "H264": r"a=fmtp:(\d+) .*mode=1.*profile-level-id=42e0"}
"""Of H.264 the offer has several: webrtcbin answers with the very profile that the encoder makes."""


def tell(**what):
    """In one write: threads of GStreamer speak at once, and ``print`` writes the end of a line by itself."""
    os.write(sys.stdout.fileno(), f"{json.dumps(what)}\n".encode())


class Peer:
    """What both roles have in common. All on GLib's loop, but for what webrtcbin calls from threads of its own."""

    def __init__(self, codec, bundle, pictures=""):
        self.codec = codec
        self.channels = {}
        self.pipeline = Gst.Pipeline.new()
        self.bin = Gst.ElementFactory.make("webrtcbin")
        Gst.util_set_object_arg(self.bin, "bundle-policy", bundle)
        self.pipeline.add(self.bin)
        if pictures:
            source = Gst.parse_bin_from_description(pictures, True)
            self.pipeline.add(source)
            source.link(self.bin)
        self.bin.connect("on-ice-candidate", lambda _, line, text: tell(candidate=text, line=line))
        self.bin.connect("on-data-channel", lambda _, channel: self.keep(channel))
        self.bin.connect("pad-added", self.track_arrived)
        self.bin.connect("notify::connection-state", self.state_changed)
        bus = self.pipeline.get_bus()
        bus.add_signal_watch()
        bus.connect("message::error", lambda _, message: tell(failed=str(message.parse_error())))
        self.pipeline.set_state(Gst.State.PLAYING)

    def state_changed(self, *_):
        tell(state=self.bin.get_property("connection-state").value_nick)

    def keep(self, channel):
        label = channel.get_property("label")
        self.channels[label] = channel
        channel.connect("on-message-string", lambda _, text: tell(message=label, text=text))
        channel.connect("on-message-data", lambda _, data: tell(message=label, bytes=data.get_data().hex()))
        channel.connect("on-open", lambda _: tell(opened=label))
        if channel.get_property("ready-state") == GstWebRTC.WebRTCDataChannelState.OPEN:
            tell(opened=label)

    def hear(self, said):
        if "candidate" in said:
            self.bin.emit("add-ice-candidate", said["line"], said["candidate"])
        elif "send" in said:
            self.send(self.channels[said["send"]], said)
        else:
            ((kind, sdp),) = said.items()
            self.describe(kind, sdp)

    def send(self, channel, said):
        if "bytes" in said:
            channel.emit("send-data", GLib.Bytes(bytes.fromhex(said["bytes"])))
        else:
            channel.emit("send-string", said["text"])

    def describe(self, kind, sdp):
        _, message = GstSdp.SDPMessage.new_from_text(sdp)
        kind = GstWebRTC.WebRTCSDPType.OFFER if kind == "offer" else GstWebRTC.WebRTCSDPType.ANSWER
        self.ask("set-remote-description", GstWebRTC.WebRTCSessionDescription.new(kind, message))

    def ask(self, signal, argument):
        promise = Gst.Promise.new()
        self.bin.emit(signal, argument, promise)
        promise.wait()
        return promise.get_reply()

    def local(self, kind):
        reply = self.ask(f"create-{kind}", None)
        description = reply.get_value(kind)
        sdp = description.sdp.as_text()
        tell(**{kind: sdp})
        self.ask("set-local-description", description)

    def track_arrived(self, _, pad):
        if pad.get_direction() != Gst.PadDirection.SRC:
            return
        sink = Gst.parse_bin_from_description(
            f"{DECODERS[self.codec]} ! videoconvert ! video/x-raw,format=RGB ! appsink name=seen emit-signals=true",
            True,
        )
        sink.get_by_name("seen").connect("new-sample", self.picture_seen)
        self.pipeline.add(sink)
        sink.sync_state_with_parent()
        pad.link(sink.sinkpads[0])

    def picture_seen(self, sink):
        sample = sink.emit("pull-sample")
        shape = sample.get_caps().get_structure(0)
        data = sample.get_buffer().extract_dup(0, sample.get_buffer().get_size())
        tell(picture=[shape.get_value("width"), shape.get_value("height")], colours=len(set(data[::97])))
        return Gst.FlowReturn.OK


class Operator(Peer):
    def __init__(self, codec, bundle, labels):
        super().__init__(codec, bundle)
        direction = GstWebRTC.WebRTCRTPTransceiverDirection.RECVONLY
        caps = f"application/x-rtp,media=video,clock-rate=90000,encoding-name={codec},payload=96"
        self.bin.emit("add-transceiver", direction, Gst.Caps.from_string(caps))
        for label in labels:
            self.keep(self.bin.emit("create-data-channel", label, None))
        self.local("offer")


class Robot(Peer):
    """A pipeline is made when the offer says which payload type its codec has."""

    def __init__(self, codec, bundle):
        self.codec, self.bundle = codec, bundle
        self.waiting = []

    def hear(self, said):
        if "offer" in said:
            self.answer(said["offer"])
        elif not hasattr(self, "bin"):
            self.waiting.append(said)
        else:
            super().hear(said)

    def answer(self, sdp):
        payload_type = re.search(PAYLOAD_TYPE[self.codec], sdp)[1]
        super().__init__(
            self.codec,
            self.bundle,
            "videotestsrc is-live=true ! video/x-raw,width=320,height=240,framerate=15/1 ! videoconvert "
            f"! {ENCODERS[self.codec]} pt={payload_type} "
            f"! capsfilter caps=application/x-rtp,media=video,encoding-name={self.codec},payload={payload_type}",
        )
        self.describe("offer", sdp)
        self.local("answer")
        for said in self.waiting:
            super().hear(said)


def read(peer, loop):
    for line in sys.stdin:
        GLib.idle_add(peer.hear, json.loads(line))
    GLib.idle_add(loop.quit)


def main():
    Gst.init(None)
    role, codec, bundle, *labels = sys.argv[1:]
    peer = Operator(codec, bundle, labels) if role == "operator" else Robot(codec, bundle)
    loop = GLib.MainLoop()
    threading.Thread(target=read, args=(peer, loop), daemon=True).start()
    loop.run()
    if hasattr(peer, "pipeline"):
        peer.pipeline.set_state(Gst.State.NULL)


if __name__ == "__main__":
    main()
