"""Checks the board that the robot runs on: probes files below ``/proc``, ``/sys`` and ``/dev``, and asks three small
programs where they are installed. What it means is judged in ``machines.diagnosis.board_verdicts``."""

from __future__ import annotations

import asyncio
import grp
import os
import pwd
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from mosaic_core.machines.diagnosis.board_verdicts import (
    Board,
    DeviceAccess,
    ThermalZone,
    access_finding,
    clock_finding,
    governor_finding,
    heat_finding,
    memory_finding,
    model_finding,
    power_finding,
    wifi_finding,
)
from mosaic_core.words.finding import Finding

ROOT = Path("/")
PROGRAM_TIMEOUT_S = 2.0
MAX_READ_BYTES = 16 * 1024
_DEVICES = ("video*", "dri/renderD*", "ttyACM*", "ttyUSB*", "ttyAMA*", "ttyTHS*", "snd/pcm*")
_BOARD_DEVICES = ("i2c-*", "gpiochip*", "spidev*")
"""On a PC these belong to its fans and memory, and no robot wants them."""
_LIMITING_TRIPS = frozenset({"passive", "hot", "critical"})
"""Where the kernel holds the clock down, warns, or switches off; ``active`` ones start a fan."""


async def board_checks(root: Path = ROOT) -> AsyncIterator[Finding]:
    """Everything about the board. ``root``: where ``proc``, ``sys`` and ``dev`` are."""
    board = Board(board_model(root))
    yield model_finding(board)
    yield power_finding(await throttled_bits(root), board)
    yield heat_finding(thermal_zones(root), board)
    yield governor_finding(clock_governors(root), board)
    yield wifi_finding({name: await power_save(name) for name in wireless_interfaces(root)}, board)
    yield access_finding(device_accesses(root, board), board)
    yield memory_finding(*memory_bytes(root), board)
    yield clock_finding(await clock_is_synchronized(), board)


def board_model(root: Path) -> str:
    """The device tree's model on ARM boards, the product of the firmware's tables on PCs; empty where neither is."""
    tree = _text(root / "proc/device-tree/model").rstrip("\0")
    return tree or _text(root / "sys/class/dmi/id/product_name")


async def throttled_bits(root: Path) -> int | None:
    """What a Raspberry Pi's firmware says of voltage and heat; ``None`` on other machines."""
    told = _text(root / "sys/devices/platform/soc/soc:firmware/get_throttled")
    if not told and _text(root / "proc/device-tree/model").startswith("Raspberry Pi"):
        told = await _said("vcgencmd", "get_throttled")
    try:
        return int(told.rpartition("=")[2], 16)
    except ValueError:
        return None


def thermal_zones(root: Path) -> list[ThermalZone]:
    """All zones that give a temperature."""
    found = []
    for folder in sorted((root / "sys/class/thermal").glob("thermal_zone*")):
        thousandths = _number(folder / "temp")
        if thousandths is not None:
            name = _text(folder / "type") or folder.name
            found.append(ThermalZone(name, thousandths / 1000, tuple(_trips_c(folder))))
    return found


def _trips_c(zone: Path) -> Iterator[float]:
    for kind in sorted(zone.glob("trip_point_*_type")):
        thousandths = _number(kind.with_name(kind.name.removesuffix("type") + "temp"))
        if thousandths is not None and _text(kind) in _LIMITING_TRIPS:
            yield thousandths / 1000


def clock_governors(root: Path) -> list[tuple[str, str]]:
    """Driver and governor of each clock domain."""
    policies = sorted((root / "sys/devices/system/cpu/cpufreq").glob("policy*"))
    pairs = ((_text(one / "scaling_driver"), _text(one / "scaling_governor")) for one in policies)
    return [(driver, governor) for driver, governor in pairs if governor]


def wireless_interfaces(root: Path) -> list[str]:
    """Names of those that are up."""
    folders = sorted((root / "sys/class/net").glob("*"))
    return [
        one.name
        for one in folders
        if ((one / "wireless").exists() or (one / "phy80211").exists()) and _text(one / "operstate") == "up"
    ]


async def power_save(interface: str) -> bool | None:
    """Whether the radio sleeps between packets; ``None`` where ``iw`` is not installed or does not know."""
    said = (await _said("iw", "dev", interface, "get", "power_save")).lower()
    return None if "power save:" not in said else said.endswith("on")


def device_accesses(root: Path, board: Board) -> list[DeviceAccess]:
    """Device files of groups that an account can be put in: not of root's alone."""
    patterns = _DEVICES if board.kind == "x86" else (*_DEVICES, *_BOARD_DEVICES)
    found = []
    for path in (path for pattern in patterns for path in sorted((root / "dev").glob(pattern))):
        group = _group_of(path)
        if group not in (None, "root"):
            is_usable = os.access(path, os.R_OK | os.W_OK)
            found.append(DeviceAccess(f"/{path.relative_to(root)}", str(group), is_usable, _is_listed(str(group))))
    return found


def _group_of(path: Path) -> str | None:
    try:
        return path.group()
    except (OSError, KeyError):
        return None  # it was pulled out this moment, or its group has no name here


def _is_listed(group: str) -> bool:
    """Whether the account is entered in the group, though this session may have begun before."""
    try:
        return pwd.getpwuid(os.geteuid()).pw_name in grp.getgrnam(group).gr_mem
    except KeyError:
        return False


def memory_bytes(root: Path) -> tuple[int | None, int | None]:
    """Available and total."""
    lines = (line.partition(":") for line in _text(root / "proc/meminfo").splitlines())
    kib = {name: rest.split()[0] for name, _, rest in lines if rest.split()}
    available, total = (kib.get(name, "") for name in ("MemAvailable", "MemTotal"))
    return (int(available) * 1024, int(total) * 1024) if available.isdecimal() and total.isdecimal() else (None, None)


async def clock_is_synchronized() -> bool | None:
    """What the kernel knows of it, whoever keeps the clock; ``None`` where systemd does not run."""
    return {"yes": True, "no": False}.get(await _said("timedatectl", "show", "-p", "NTPSynchronized", "--value"))


def _text(path: Path) -> str:
    """The file's text, empty where it can't be read: files of the kernel fail in many ways."""
    try:
        with path.open("rb") as file:
            return file.read(MAX_READ_BYTES).decode(errors="replace").strip()
    except OSError:
        return ""


def _number(path: Path) -> int | None:
    try:
        return int(_text(path))
    except ValueError:
        return None


async def _said(*words: str) -> str:
    """The standard output of a program; empty where it is missing, fails, or takes too long."""
    try:
        running = await asyncio.create_subprocess_exec(
            *words, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL
        )
    except OSError:
        return ""
    try:
        async with asyncio.timeout(PROGRAM_TIMEOUT_S):
            said, _ = await running.communicate()
    except TimeoutError:
        running.kill()
        await running.wait()
        return ""
    return said[:MAX_READ_BYTES].decode(errors="replace").strip() if running.returncode == 0 else ""
