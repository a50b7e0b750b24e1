"""Opens the port of a link, or says why it can't be opened and what to do."""

from __future__ import annotations

from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.fake.fake_port import FakePort
from mosaic_mavlink.link.address import LinkAddress
from mosaic_mavlink.link.ports import Port, SerialPort, TcpPort, UdpPort

_CURES = {
    "udpin": "see whether another ground station listens on this port",
    "udpout": "check host name and network",
    "tcp": "start the simulator or bridge that listens there",
    "serial": "plug it in, see who else has it open, and whether this account is in the group dialout",
    "fake": "free a UDP port of this machine",
}


def opened_port(address: LinkAddress, baud: int) -> Port:
    """Open the port of ``address``. Blocks for 2 s at most. Raises :class:`DeviceGone` that names it and the cure."""
    try:
        return _opened(address, baud)
    except (OSError, ValueError) as error:  # pyserial's errors are OSErrors, or ValueError for an impossible baud
        where = f"{address.host}:{address.port}" if address.port else address.host
        reason = getattr(error, "strerror", None) or str(error)
        raise DeviceGone(
            f"the MAVLink link {address.transport} {where} can't be opened: {reason}", _CURES[address.transport]
        ) from error


def _opened(address: LinkAddress, baud: int) -> Port:
    match address.transport:
        case "udpin":
            return UdpPort((address.host, address.port), None)
        case "udpout":
            return UdpPort(None, (address.host, address.port))
        case "tcp":
            return TcpPort(address.host, address.port)
        case "serial":
            return SerialPort(address.host, baud)
        case "fake":
            return FakePort(address.host)
