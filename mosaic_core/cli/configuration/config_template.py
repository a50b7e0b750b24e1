"""The file that ``mosaic config init`` writes: it validates as it is, with the connectors that are installed."""

from __future__ import annotations

from collections.abc import Collection

_HEAD = """\
# A MOSAIC robot. Check this file with `mosaic validate`, run it with `mosaic run`.
# ${NAME} reads an environment variable, ${file:/run/secrets/x} a file; write $${ for the characters themselves.
version: 1

server:
  # Where your server listens, without a path: wss:// behind TLS, ws:// on this machine or a trusted network.
  ws_url: ws://127.0.0.1:9001
  auth:
    type: simple-token
    # `mosaic server robot add NAME` shows both once. The id may stand here as it is; keep the token out of the file.
    robot_id: ${MOSAIC_ROBOT_ID}
    params:
      token: ${MOSAIC_TOKEN}
  # The server hands out its own STUN and TURN servers; more can be named here.
  # webrtc:
  #   ice_servers:
  #     - { urls: ["turn:turn.example.org:3478"], username: robot, credential: "${TURN_PASSWORD}" }

# Each connector: its type (`mosaic connectors list`), a label of your choice that operators see, and the type's own
# params (`mosaic connectors show TYPE`).
connectors:
"""

_CONNECTORS = {
    "connection-check": """\
  # Measures the round trip between operator and robot.
  - type: connection-check
    label: link
""",
    "host-load": """\
  # Processor, memory, disk and temperature of this computer.
  - type: host-load
    label: host
""",
    "camera": """\
  # A webcam, a video file or an RTSP/HTTP URL. Nobody watching: nothing is captured.
  - type: camera
    label: front
    params:
      source: /dev/video0
      width: 640
      height: 480
      fps: 30
""",
    "cmd-vel": """\
  # Velocity commands. The drive `log` only writes what it would do; `mosaic connectors show cmd-vel` lists others.
  - type: cmd-vel
    label: cmd_vel
    params:
      drive: { type: log }
    # Enforced on the robot: silence stops it, faster commands are clamped.
    safety:
      timeout_s: 0.3
      max_linear_mps: 0.5
      max_angular_radps: 1.0
    delivery: latest
""",
}


def config_template(installed: Collection[str]) -> str:
    """The commented file; connectors whose type is not installed are left out."""
    connectors = [text for name, text in _CONNECTORS.items() if name in installed]
    return _HEAD + ("\n".join(connectors) if connectors else "  []\n")
