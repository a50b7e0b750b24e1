"""The one table of reason codes.

A code names *why* something was refused, closed or failed. The same word appears in exceptions, WebSocket and
peer close messages, the command line and the dashboard, so that a user can search for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason code, one sentence for people, and what to do about it."""

    code: str
    sentence: str
    cure: str = ""


REASONS: dict[str, Reason] = {
    reason.code: reason
    for reason in (
        # config.*: the YAML file
        Reason("config.unreadable", "The configuration file can't be read.", "Check the path and its permissions."),
        Reason(
            "config.syntax",
            "The configuration file isn't valid YAML.",
            "Mind the indentation, the colons and the quotes where it says.",
        ),
        Reason("config.invalid", "The configuration has mistakes.", "Run `mosaic validate FILE`."),
        Reason("config.unknown_type", "No installed plugin offers this type.", "Run `mosaic connectors list`."),
        Reason("config.ambiguous_type", "Two distributions claim the same connector type.", "Uninstall one of them."),
        Reason(
            "config.duplicate_label",
            "Two connectors share a label or a channel name.",
            "Give each connector a label of its own.",
        ),
        Reason(
            "config.missing_env",
            "An environment variable that the configuration names isn't set.",
            "Set it where the robot is started.",
        ),
        Reason(
            "config.broken_plugin",
            "A plugin that the configuration uses can't be loaded.",
            "Update or uninstall the distribution that it names.",
        ),
        Reason("config.metrics", "The robot can't serve its metrics this way.", "Check the address after --metrics."),
        Reason("config.lan", "The robot can't serve its own network this way.", "Check the options after --serve."),
        # auth.*: who are you
        Reason("auth.required", "Authorization comes first.", "Log in first."),
        Reason("auth.failed", "The credentials were refused.", "Check the robot id and token, or log in again."),
        Reason("auth.unknown_robot", "The server knows no robot with this id.", "Check the robot's id."),
        Reason("auth.expired", "The log-in has expired.", "Log in again."),
        Reason(
            "auth.forbidden", "This account may not do that.", "Ask an administrator of the organization for access."
        ),
        Reason(
            "auth.pairing",
            "This PIN or code is wrong, was used already, or is too old.",
            "Look at the robot's terminal for the current one, or run `mosaic lan pair` on the robot.",
        ),
        Reason(
            "auth.bad_ticket",
            "The operator's ticket is missing, expired or not signed by the robot's server.",
            "Connect again; if that does not help, let robot and server set their clocks by NTP.",
        ),
        Reason(
            "auth.role_changed",
            "The operator's role on this robot was changed, or the account was disabled; the connection was closed.",
            "Connect again: the new role counts from then on.",
        ),
        Reason("auth.unknown_account", "The organization has no account with this id.", "Check the account."),
        Reason(
            "auth.own_account",
            "Nobody may raise the own role, or change the own account's kind.",
            "Ask another administrator of the organization.",
        ),
        Reason(
            "auth.last_supervisor",
            "A robot would be left without anybody who supervises it.",
            "Make somebody else a supervisor first.",
        ),
        Reason(
            "auth.last_admin",
            "The organization would be left without an administrator.",
            "Make somebody else an administrator first.",
        ),
        Reason(
            "auth.roles_unknown",
            "This robot knows no roles, so that an observer could drive it.",
            "Give the account the role operator, or update the robot.",
        ),
        # rest.*: one request to the server
        Reason(
            "rest.unknown_path",
            "The server has nothing at this path.",
            "Compare it with /openapi.json, which lists every path of the server.",
        ),
        Reason(
            "rest.wrong_method",
            "This path is there, but not for this method.",
            "Use a method that the message names; /openapi.json lists them all.",
        ),
        Reason(
            "rest.bad_request",
            "The server did not accept this request.",
            "Change what the message names; /openapi.json has the fields of every request.",
        ),
        Reason("rest.server_mistake", "The server made a mistake.", "See what the server's log says, and report it."),
        # signal.*: the server in the middle
        Reason("signal.bad_message", "A message could not be understood.", "Update the older of the two sides."),
        Reason("signal.too_large", "A message was larger than allowed.", "Update the older of the two sides."),
        Reason("signal.timeout", "The other side fell silent.", "Check the network between the two."),
        Reason(
            "signal.replaced",
            "The same robot connected a second time; the newest one wins.",
            "Stop the other process or give it an identity of its own.",
        ),
        Reason(
            "signal.too_slow",
            "The receiver did not keep up, or sent too much.",
            "Check the network between the two: it is slow, or loses much.",
        ),
        Reason("signal.unreachable", "The server can't be reached.", "Check the server's address and the network."),
        Reason(
            "signal.robot_offline",
            "The robot isn't connected to the server.",
            "Start it with `mosaic run`, or run `mosaic doctor mosaic_config.yaml` on it.",
        ),
        Reason(
            "signal.robot_busy",
            "The robot takes one operator at a time and has one.",
            "Wait until the other operator has left.",
        ),
        Reason(
            "signal.unknown_connection",
            "No such connection, or it isn't yours.",
            "See which robots this account has, and connect anew.",
        ),
        Reason(
            "signal.no_user_socket",
            "This account has no open and authorized /ws/user, over which its offer has to go.",
            "Open /ws/user and authorize first, and keep it open while the connection is made.",
        ),
        Reason("signal.unknown_tab", "The organization has no such tab.", "Load the list of tabs again."),
        Reason("signal.unknown_map", "The organization has no such map.", "Load the list of maps again."),
        Reason("signal.too_many", "The organization keeps as many of these as it may.", "Remove one first."),
        Reason("signal.server_restart", "The server is restarting.", "Wait a moment, then try again."),
        Reason(
            "signal.no_answer",
            "The robot did not answer the offer in time.",
            "See what the robot's log says; if it is busy, try again.",
        ),
        Reason(
            "signal.name_unknown",
            "The server's name can't be resolved.",
            "Check the spelling of the address and the name server of this machine.",
        ),
        Reason(
            "signal.tls",
            "The server's certificate can't be trusted.",
            "Use a certificate for this very name from an authority that this machine trusts.",
        ),
        Reason(
            "signal.certificate_ends",
            "The server's certificate ends soon.",
            "Renew it, and see why that does not happen by itself.",
        ),
        Reason(
            "signal.not_mosaic",
            "What answers at this address is no MOSAIC server.",
            "Check host and port; a proxy in front must pass /api and /ws on.",
        ),
        Reason(
            "signal.no_websocket",
            "The server answers, but WebSockets do not get through to it.",
            "Let the proxy in front of the server pass on `Upgrade: websocket` for /ws.",
        ),
        Reason(
            "signal.original_server",
            "The server speaks no extensions: it is an original one, or older than this.",
            "Robots and operators connect; roles, several operators and TURN credentials need a newer server.",
        ),
        Reason(
            "signal.clock_skew",
            "The clocks of this machine and of the server differ.",
            "Let both set their clocks by NTP (`timedatectl set-ntp true`); tickets and certificates depend on it.",
        ),
        # sdp / ice / dtls / channel: the phases of one peer connection
        Reason("sdp.invalid", "The session description could not be understood.", "Update the older of the two sides."),
        Reason(
            "sdp.no_common_codec",
            "Operator and robot share no codec for one of the media lines.",
            "Let the camera's `codec` be one that the operator's browser decodes.",
        ),
        Reason(
            "sdp.timeout",
            "The session description was not made in time.",
            "This machine may be overloaded; try again, and run `mosaic doctor`.",
        ),
        Reason(
            "ice.no_address",
            "This machine has no network address that WebRTC can use.",
            "Bring up a network interface; loopback alone is never offered by WebRTC.",
        ),
        Reason(
            "ice.no_relay",
            "No TURN server gave an address, and nothing else may be used.",
            "See what `mosaic run --log-level info` says of the TURN server, or allow ice_transport_policy: all.",
        ),
        Reason(
            "ice.timeout",
            "No network path to the other side was found in time.",
            "Both sides may be behind NAT: configure a TURN server.",
        ),
        Reason("ice.failed", "The network path to the other side failed.", "Run `mosaic doctor` on both sides."),
        Reason(
            "ice.link_local_only",
            "This machine has link-local addresses only.",
            "See why its network interface got no address (DHCP, cable, Wi-Fi password).",
        ),
        Reason(
            "ice.no_ipv4",
            "This machine has no IPv4 address; operators without IPv6 need a TURN server.",
            "Ask for IPv4 on this network, or have a TURN server with addresses of both families.",
        ),
        Reason(
            "ice.no_servers",
            "No STUN or TURN server is known: connections work within one network only.",
            "Set up a TURN server (docs/howto/turn.md) and tell it to the server: `mosaic server ice add`.",
        ),
        Reason(
            "ice.stun_silent",
            "The STUN server does not answer.",
            "Check its address, and that UDP to it isn't blocked.",
        ),
        Reason(
            "ice.turn_silent",
            "The TURN server does not answer.",
            "Check its address and port, its firewall, and that this network lets the protocol out.",
        ),
        Reason(
            "ice.turn_refused",
            "The TURN server refuses the credentials.",
            "Compare the shared secret of TURN server and MOSAIC server, and the clocks of both.",
        ),
        Reason(
            "ice.turn_no_credentials",
            "A TURN server needs credentials, and none are known.",
            "Add it to the server with its secret (`mosaic server ice add --secret-file FILE turn:…`), or to the "
            "robot's file with `username` and `credential`.",
        ),
        Reason(
            "ice.bad_url",
            "The address of an ICE server can't be read.",
            "Write `stun:HOST:PORT` or `turn:HOST:PORT?transport=tcp` (`mosaic server ice list`, `remove` and `add`).",
        ),
        Reason(
            "ice.turn_quota",
            "The TURN server has no allocation left for this account.",
            "Raise `user-quota` or `total-quota` of the TURN server, or wait until old allocations end.",
        ),
        Reason(
            "ice.turn_tls",
            "TLS to the TURN server fails.",
            "Give it a certificate for this very name from an authority that this machine trusts, or name that "
            "authority's file in `SSL_CERT_FILE`; and check that the port is the one for TLS.",
        ),
        Reason("ice.turn_forbidden", "The TURN server forbids this.", "Look into the TURN server's log."),
        Reason("ice.turn_failed", "The TURN server gives no relayed address.", "Look into the TURN server's log."),
        Reason(
            "ice.no_turn",
            "No TURN server works from here.",
            "Without one, connections between two strict networks fail: set one up (docs/howto/turn.md).",
        ),
        Reason(
            "ice.nat_symmetric",
            "The NAT in front of this machine takes another port for every destination (symmetric NAT).",
            "Direct connections fail unless the other side is reachable: have a TURN server.",
        ),
        Reason(
            "ice.nat_unknown",
            "What kind of NAT is in front of this machine is unknown: that takes two STUN servers.",
            "Name two STUN servers at different addresses.",
        ),
        Reason(
            "ice.mdns_only",
            "The browser hides its local addresses behind names that only work on the same network segment.",
            "Allow the microphone once for this page if robots on another local network can't be reached.",
        ),
        Reason("dtls.timeout", "The encrypted connection could not be set up in time.", "Run `mosaic doctor`."),
        Reason(
            "dtls.failed",
            "The encrypted connection could not be set up.",
            "Something between the two changes packets, or one side is too old; run `mosaic doctor` on both.",
        ),
        Reason(
            "channel.timeout",
            "The data channel did not open in time.",
            "Large packets may get lost on the way (VPN, MTU); try again, and run `mosaic doctor`.",
        ),
        Reason(
            "channel.unknown_label",
            "The robot has no connector with this label.",
            "Compare it with the labels in the robot's configuration.",
        ),
        Reason(
            "channel.unknown_data_type",
            "There is no such data type.",
            "Use json-r2u, json-u2r, json-bi, string-r2u, string-u2r, byte-r2u, byte-u2r or media.",
        ),
        Reason("channel.queue_full", "Data was produced faster than the link takes it."),
        Reason("channel.too_large", "A message was larger than the channel takes."),
        Reason("channel.invalid", "A message does not fit the connector's schema."),
        Reason(
            "channel.incomplete",
            "Parts of a large message did not arrive in time, so that it was forgotten.",
            "Send it again; send large messages with delivery `bulk` or `reliable`, or make them smaller.",
        ),
        Reason(
            "channel.wrong_lane",
            "The second connection carries connectors with delivery bulk only.",
            "Set `delivery: bulk` for this connector.",
        ),
        Reason(
            "lane.refused",
            "The robot makes no second connection for bulk data now; it goes over the main one.",
        ),
        Reason(
            "media.no_line",
            "The offer had no media line left for this camera.",
            "Connect again; of an original robot, name all cameras when connecting.",
        ),
        Reason(
            "media.no_encoder",
            "No video encoder for this operator's codec works on the robot.",
            "Run `mosaic doctor encoders` on the robot.",
        ),
        Reason(
            "media.not_decodable",
            "The camera sends a codec that this operator does not have, and the robot can't convert it.",
            "Set the camera to H.264, or `passthrough: never`.",
        ),
        Reason(
            "media.encoded_only",
            "The camera encodes by itself: its pictures can't be had as they were captured.",
            "Tap its encoded pictures, or set `passthrough: never`.",
        ),
        Reason(
            "media.no_first_frame",
            "The camera is watched, but no picture came in time.",
            "Check the camera on the robot; `mosaic run` shows what it sends.",
        ),
        Reason(
            "media.not_sent",
            "The robot sends no picture: its camera or its encoder gives none.",
            "Check the camera on the robot with `mosaic doctor`; its log names the cause.",
        ),
        Reason(
            "media.no_packets",
            "The robot sends pictures, but none of their packets arrive.",
            "Something on the way drops large packets (VPN, MTU) or is overloaded; try another network or TURN.",
        ),
        Reason(
            "media.not_decoded",
            "Packets of the picture arrive, but none can be decoded.",
            "Reload the page; if that does not help, set the camera's codec to VP8 or H.264 baseline.",
        ),
        Reason("media.talk_busy", "Somebody else is talking.", "Wait until they have finished."),
        # peer.*: why a peer connection ended
        Reason("peer.closed", "The other side closed the connection."),
        Reason("peer.lost", "The other side fell silent."),
        Reason("peer.replaced", "The same session connected again."),
        Reason("peer.shutdown", "The robot is shutting down."),
        Reason("peer.not_allowed", "The robot does not take this operator."),
        # safety.*: commands refused
        Reason("safety.stale", "The command was too old when it arrived."),
        Reason("safety.out_of_order", "A newer command had arrived before this one."),
        Reason("safety.not_finite", "The command holds a value that is not a number."),
        Reason("safety.timeout", "No command arrived in time; the safe action ran."),
        Reason("safety.peer_left", "The commanding operator left; the safe action ran."),
        Reason("safety.shutdown", "The robot is stopping; the safe action ran."),
        Reason("safety.lease_lost", "The commanding operator lost the lease; the safe action ran."),
        Reason("safety.stop", "An operator said stop; the safe action ran."),
        Reason(
            "safety.stopped",
            "The robot was stopped and takes no commands until that is cleared.",
            "Look at the robot, then clear the stop: the lease holder or a supervisor can.",
        ),
        Reason(
            "safety.no_stop",
            "This robot has no stop: it runs an original MOSAIC.",
            "Use the switch on the robot; `mosaic operator stop --drive LABEL` sends zeros to what drives it.",
        ),
        Reason("safety.too_fast", "Commands came faster than this connector takes them."),
        Reason("safety.out_of_range", "A value of the command can't be limited: it is no number where one belongs."),
        # lease.*: the right to command
        Reason("lease.required", "This connector takes commands only from the holder of its lease.", "Take control."),
        Reason("lease.not_holder", "Somebody else commands this robot.", "Ask for the lease and wait for the answer."),
        Reason("lease.old_epoch", "The command belongs to a lease that has ended."),
        Reason("lease.queued", "Somebody else commands; the request waits for an answer."),
        Reason("lease.denied", "The operator who commands did not hand over."),
        Reason("lease.forbidden", "This role may not command.", "An administrator can grant another role."),
        Reason("lease.force_forbidden", "Only a supervisor who gives a reason may take over by force."),
        Reason("lease.person_commands", "A person commands; a program waits until the lease is free."),
        Reason("lease.unknown_resource", "The robot has no resource of this name."),
        Reason("lease.expired", "The holder fell silent, so the lease ended."),
        Reason("lease.released", "The lease was given back."),
        Reason("lease.handed_over", "The holder handed the lease to somebody else."),
        Reason("lease.taken_over", "A supervisor took the lease over."),
        Reason("lease.preempted", "A person took the lease from a program."),
        Reason("lease.peer_left", "The holder's connection ended, and with it the lease."),
        Reason("lease.original_observes", "This robot lets original dashboards watch, but not command."),
        # check.*: what `mosaic doctor` and the dashboard's check find besides
        Reason("check.ok", "It works."),
        Reason("check.skipped", "It was not looked at."),
        Reason("check.failed", "The check itself failed.", "Please report it with the text of the error."),
        Reason("check.timeout", "The check took too long.", "Run `mosaic doctor --only` with its name alone."),
        Reason("check.old_python", "This Python is too old.", "Install Python 3.11 or newer."),
        Reason(
            "check.odd_platform",
            "This kind of machine is not tested.",
            "Use Linux on x86_64 or aarch64 where it matters, and report what fails here.",
        ),
        Reason(
            "check.version_mismatch",
            "Distributions of MOSAIC have different versions.",
            "Update all of them together: `pip install --upgrade mosaic-core mosaic-…`.",
        ),
        Reason(
            "check.no_uvloop",
            "uvloop is not used: small messages travel about ten times slower.",
            "`pip install uvloop`.",
        ),
        Reason(
            "check.slow_loop",
            "The event loop is late: this machine is overloaded.",
            "See with `top` what else runs; lower the cameras' size or rate.",
        ),
        Reason(
            "check.disk_full",
            "The disk is almost full.",
            "Delete what isn't needed; recordings take the most.",
        ),
        Reason(
            "check.small_udp_buffer",
            "The kernel allows small receive buffers only: bursts lose packets.",
            "`sudo sysctl -w net.core.rmem_max=4194304`, and the same in /etc/sysctl.d to keep it.",
        ),
        Reason(
            "check.no_realtime",
            "Safety threads may not run before ordinary ones: stops come later on a busy machine.",
            "Give the service `LimitRTPRIO=1` (systemd), or the account an rtprio limit.",
        ),
        Reason(
            "check.slow_path",
            "A connection through this machine is slow.",
            "Another program may take the processor; a camera needs about 2 Mbit/s.",
        ),
        Reason(
            "check.no_webrtc",
            "This browser has no WebRTC.",
            "Use a current Chrome, Edge, Firefox or Safari; some privacy settings switch it off.",
        ),
        Reason(
            "check.no_peer_connection",
            "This browser makes no peer connection.",
            "Mind what it says of it; close pages with many connections, and check the addresses of the ICE servers "
            "(`mosaic server ice list`).",
        ),
        Reason(
            "check.insecure_page",
            "The page came without TLS: microphone, gamepad and some decoders are off.",
            "Open it over https, or from localhost.",
        ),
        Reason("check.no_microphone", "The microphone may not be used.", "Allow it in the browser's site settings."),
        Reason(
            "check.no_gamepad",
            "This browser gives no gamepads to this page.",
            "Open it over https or from localhost, in a current browser; or drive with keys, or the pad on the screen.",
        ),
        Reason(
            "check.no_decoder",
            "This browser can't decode one of the codecs that robots send.",
            "Use a current Chrome, Edge or Safari, or let the cameras' `codec` be one that this browser decodes.",
        ),
        Reason(
            "check.far_server",
            "The server is far away: setting up takes longer than it must.",
            "Use a server that is nearer, or see what slows the way to it; once connected it no longer matters.",
        ),
        # plugin.*: handlers
        Reason("plugin.failed", "The connector's handler ended with an error; it will be restarted."),
        Reason(
            "plugin.no_device",
            "The connector's device isn't available; it is being tried again.",
            "Plug it in, and see whether another program holds it.",
        ),
        Reason(
            "plugin.no_permission",
            "This account may not use a device that the configuration names.",
            "Add it to the group that owns the device, e.g. `sudo usermod -aG video,dialout $USER`, and log in again.",
        ),
        Reason("plugin.ignored_stop", "The handler did not stop in time and was abandoned."),
        # recorder.*: recordings on the robot
        Reason("recorder.already_recording", "This is being recorded already.", "Stop or resume that recording."),
        Reason("recorder.not_recording", "Nothing of this is being recorded.", "Start a recording first."),
        Reason(
            "recorder.unknown_camera",
            "The recorder is not configured for this camera.",
            "Add its label to the recorder's `labels`.",
        ),
        Reason("recorder.unknown_file", "The recorder has no file of this name.", "Ask for the list again."),
        Reason("recorder.file_in_use", "The file is being written.", "Stop the recording first."),
        Reason(
            "recorder.disk_full",
            "The robot's disk is full, or at the reserve that the recorder leaves.",
            "Delete recordings, or let `keep_bytes` do it.",
        ),
        Reason("recorder.write_failed", "The robot could not use the file or its folder.", "Check both, and the disk."),
        Reason("recorder.max_seconds", "The recording reached its longest time and ended."),
        Reason("recorder.max_bytes", "The recording reached its largest size and ended."),
        Reason("recorder.no_picture", "The camera gave no picture that could be stored.", "Check the camera."),
        Reason("recorder.busy", "Too many snapshots are being taken at once.", "Wait for the answers."),
        Reason("recorder.failed", "The recording ended with an error.", "Look into the robot's log."),
    )
}


def reason(code: str) -> Reason:
    """The table's entry; :class:`KeyError` for a code that nobody defined."""
    return REASONS[code]


class CloseCode(IntEnum):
    """WebSocket close codes of our servers (4000-4999 is the range for applications, RFC 6455 §7.4.2)."""

    BAD_MESSAGE = 4400
    AUTH = 4401
    FORBIDDEN = 4403
    TIMEOUT = 4408
    REPLACED = 4409
    TOO_LARGE = 4413
    TOO_SLOW = 4429


CLOSE_REASONS: dict[CloseCode, str] = {
    CloseCode.BAD_MESSAGE: "signal.bad_message",
    CloseCode.AUTH: "auth.failed",
    CloseCode.FORBIDDEN: "auth.forbidden",
    CloseCode.TIMEOUT: "signal.timeout",
    CloseCode.REPLACED: "signal.replaced",
    CloseCode.TOO_LARGE: "signal.too_large",
    CloseCode.TOO_SLOW: "signal.too_slow",
}


class ResultCode(IntEnum):
    """The numbers that the original MOSAIC server puts on the wire and into REST envelopes."""

    SUCCESS = 100
    ACCESS_TOKEN_DECRYPTING_FAILED = 2002
    ACCESS_TOKEN_EXPIRED = 2004
    ACCESS_TOKEN_NOT_EXIST = 2015
    UNKNOWN_EXCEPTION_OCCURRED = 10000
    INVALID_FORMAT = 10001
    UNKNOWN_WEBSOCKET_REQUEST_TYPE = 10002
    ACCESS_DENIED = 10020
    AUTHENTICATION_FAILED = 10021
    WEBSOCKET_SESSION_NOT_EXIST = 10050
    ROBOT_WS_SESSION_NOT_EXIST = 10051
    USER_WS_SESSION_NOT_EXIST = 10052
    WEBRTC_SESSION_NOT_EXIST = 10053
    INVALID_ROBOT_AUTH_TYPE = 10055
    USER_NOT_FOUND = 10060
    USER_NOT_ACTIVE = 10061
    INVALID_PASSWORD = 10062
    USER_ALREADY_EXISTS = 10064
    CANNOT_DELETE_YOURSELF = 10069
    OCCUPANCY_MAP_NOT_FOUND = 10080
    ROBOT_NOT_FOUND = 20001
    ROBOT_NOT_IN_SAME_ORGANIZATION = 20006
    ROBOT_NOT_READY_TO_CONNECT = 20007


RESULT_REASONS: dict[ResultCode, str] = {
    ResultCode.ACCESS_TOKEN_DECRYPTING_FAILED: "auth.failed",
    ResultCode.ACCESS_TOKEN_EXPIRED: "auth.expired",
    ResultCode.ACCESS_TOKEN_NOT_EXIST: "auth.required",
    ResultCode.INVALID_FORMAT: "signal.bad_message",
    ResultCode.UNKNOWN_WEBSOCKET_REQUEST_TYPE: "signal.bad_message",
    ResultCode.ACCESS_DENIED: "auth.forbidden",
    ResultCode.AUTHENTICATION_FAILED: "auth.failed",
    ResultCode.WEBSOCKET_SESSION_NOT_EXIST: "signal.robot_offline",
    ResultCode.ROBOT_WS_SESSION_NOT_EXIST: "signal.robot_offline",
    ResultCode.USER_WS_SESSION_NOT_EXIST: "signal.no_user_socket",
    ResultCode.WEBRTC_SESSION_NOT_EXIST: "signal.unknown_connection",
    ResultCode.USER_NOT_FOUND: "auth.failed",
    ResultCode.USER_NOT_ACTIVE: "auth.forbidden",
    ResultCode.INVALID_PASSWORD: "auth.failed",
    ResultCode.CANNOT_DELETE_YOURSELF: "auth.own_account",
    ResultCode.OCCUPANCY_MAP_NOT_FOUND: "signal.unknown_map",
    ResultCode.ROBOT_NOT_FOUND: "auth.unknown_robot",
    ResultCode.ROBOT_NOT_IN_SAME_ORGANIZATION: "auth.forbidden",
    ResultCode.ROBOT_NOT_READY_TO_CONNECT: "signal.robot_busy",
}
