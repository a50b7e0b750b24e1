"""An RTSP camera by GStreamer, as a program of its own, because Debian's Python has the binding.

    /usr/bin/python3 rtsp_server.py PORT [USER PASSWORD]

It serves /h264, with a key frame every half second, and /jpeg; 320 × 240, 15 pictures per second. The port (0: any) is
printed when it listens.
"""

import sys

import gi

for namespace in ("Gst", "GstRtspServer"):
    gi.require_version(namespace, "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

PICTURES = "videotestsrc is-live=true ! video/x-raw,format=I420,width=320,height=240,framerate=15/1"
PATHS = {
    "/h264": "openh264enc complexity=low gop-size=8 ! video/x-h264,profile=constrained-baseline "
    "! h264parse ! rtph264pay name=pay0 pt=96 config-interval=-1",
    "/jpeg": "jpegenc ! rtpjpegpay name=pay0 pt=26",
}


def serve(port, *credentials):
    Gst.init(None)
    server = GstRtspServer.RTSPServer.new()
    server.set_address("127.0.0.1")
    server.set_service(port)
    if credentials:
        server.set_auth(who_knows(*credentials))
    for path, encoded in PATHS.items():
        factory = GstRtspServer.RTSPMediaFactory.new()
        factory.set_launch(f"( {PICTURES} ! {encoded} )")
        factory.set_shared(True)
        if credentials:
            permissions = GstRtspServer.RTSPPermissions()
            for right in ("media.factory.access", "media.factory.construct"):
                permissions.add_permission_for_role("viewer", right, True)
            factory.set_permissions(permissions)
        server.get_mount_points().add_factory(path, factory)
    if not server.attach(None):
        sys.exit("can't listen")
    print(server.get_bound_port(), flush=True)
    GLib.MainLoop().run()


def who_knows(user, password):
    token = GstRtspServer.RTSPToken()
    token.set_string("media.factory.role", "viewer")
    auth = GstRtspServer.RTSPAuth.new()
    auth.add_basic(GstRtspServer.RTSPAuth.make_basic(user, password), token)
    return auth


serve(*sys.argv[1:])
