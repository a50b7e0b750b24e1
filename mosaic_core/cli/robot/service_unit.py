"""Writes the service file by which systemd starts a robot: who it is, what it may touch, what it comes before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mosaic_core.words.errors import MosaicError

_MEANT_OTHERWISE = frozenset("\"'\\$")
"""Characters to which systemd gives a meaning, each in some settings and not in others."""
RESTART_S = 5
STOP_WITHIN_S = 10
"""A robot ends within two seconds; the rest is for a machine that is busy."""


@dataclass(frozen=True, slots=True)
class ServiceUnit:
    """The facts of a service file. ``account`` is empty for a service of the user's own manager (``systemctl
    --user``), which may change less. ``command`` is the program and its words; ``secrets`` is the folder that holds one
    file per credential, and the file of ``variables``."""

    name: str
    account: str
    groups: tuple[str, ...]
    folder: Path
    command: tuple[str, ...]
    secrets: Path
    credentials: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()

    @property
    def is_of_user(self) -> bool:
        return not self.account

    @property
    def variables_file(self) -> Path:
        return self.secrets / f"{self.name}.env"


def unit_text(unit: ServiceUnit) -> str:
    """The file. Raises :class:`MosaicError` (``config.service``) for a path that it can't name."""
    parts = (_head(unit), _unit_section(unit), _service_section(unit), _priorities(unit), _hardening(unit))
    target = "default.target" if unit.is_of_user else "multi-user.target"
    return "\n".join([*(line for part in parts for line in part), "", "[Install]", f"WantedBy={target}", ""])


def _head(unit: ServiceUnit) -> list[str]:
    user = " --user" if unit.is_of_user else ""
    folder = "~/.config/systemd/user" if unit.is_of_user else "/etc/systemd/system"
    lines = ["# A MOSAIC robot, written by `mosaic service print`.", f"# Its place: {folder}/{unit.name}.service, then"]
    lines.append(f"#   systemctl{user} daemon-reload && systemctl{user} enable --now {unit.name}")
    for name in unit.credentials:
        lines.append(f"# It reads a secret from {unit.secrets / name}: mode 600, of its owner alone.")
    if unit.variables:
        lines.append(
            f"# It reads {', '.join(unit.variables)} from {unit.variables_file}: NAME=value, a line each, mode 600."
        )
    return lines


def _unit_section(unit: ServiceUnit) -> list[str]:
    lines = ["", "[Unit]", f"Description=MOSAIC robot {unit.name}"]
    if not unit.is_of_user:
        # The robot waits for the network by itself; a clock that jumps behind its back only costs it time.
        lines += ["Wants=network-online.target", "After=network-online.target time-sync.target"]
    return lines


def _service_section(unit: ServiceUnit) -> list[str]:
    lines = ["", "[Service]", "Type=exec"]
    if not unit.is_of_user:
        lines.append(f"User={unit.account}")
        lines += [f"SupplementaryGroups={' '.join(unit.groups)}"] if unit.groups else []
    lines.append(f"WorkingDirectory={_path(unit.folder)}")
    lines += [f"LoadCredential={name}:{_path(unit.secrets / name, is_listed=True)}" for name in unit.credentials]
    lines += [f"EnvironmentFile={_path(unit.variables_file)}"] if unit.variables else []
    return [
        *lines,
        f"ExecStart={' '.join(_word(one) for one in unit.command)}",
        "# 2 is a mistake in the robot's file, which doesn't mend itself; 3 says that another robot of the same id",
        "# took its place: started again, each would put the other off for ever.",
        "Restart=on-failure",
        "RestartPreventExitStatus=2 3",
        f"RestartSec={RESTART_S}",
        f"TimeoutStopSec={STOP_WITHIN_S}",
    ]


def _priorities(unit: ServiceUnit) -> list[str]:
    if unit.is_of_user:
        return []  # an account may not raise its own
    return [
        "",
        "# Commands, pictures and whoever holds Python's lock come before other programs; the safety threads take a",
        "# real-time priority of their own, which the whole process must not have: a camera would starve the machine.",
        "Nice=-10",
        "LimitRTPRIO=1",
        "CPUSchedulingPolicy=other",
        "IOSchedulingClass=best-effort",
        "IOSchedulingPriority=2",
        "OOMScoreAdjust=-500",
    ]


def _hardening(unit: ServiceUnit) -> list[str]:
    lines = [
        "",
        "# What a robot never needs. Devices stay open to it: PrivateDevices and ProtectClock would hide them.",
        "NoNewPrivileges=yes",
        "LockPersonality=yes",
        "RestrictSUIDSGID=yes",
        "RestrictNamespaces=yes",
        "SystemCallArchitectures=native",
        "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK AF_CAN AF_BLUETOOTH",
    ]
    if unit.is_of_user:
        return lines
    kernel = [f"Protect{what}=yes" for what in ("KernelTunables", "KernelModules", "KernelLogs", "ControlGroups")]
    return [*lines, "CapabilityBoundingSet=", "ProtectSystem=full", "ProtectHostname=yes", "PrivateTmp=yes", *kernel]


def _checked(text: str, also: Sequence[str] = ()) -> str:
    bad = sorted({char for char in text if char in _MEANT_OTHERWISE or char in also or not char.isprintable()})
    if bad:
        message = f"a service file can't name {text!r}: {', '.join(map(repr, bad))} would mean something else there"
        raise MosaicError(message, code="config.service", cure="move it to a path of letters, digits, '-', '_' and '.'")
    return text.replace("%", "%%")


def _path(path: Path, *, is_listed: bool = False) -> str:
    """A path alone on its line is taken as it is, with its spaces; in a list they separate."""
    return _checked(str(path), (" ", ":") if is_listed else ())


def _word(word: str) -> str:
    checked = _checked(word)
    return f'"{checked}"' if " " in checked or not checked or ";" in checked else checked
