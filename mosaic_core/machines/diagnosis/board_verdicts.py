"""Judges a board: power, heat, clock rate, radio, permissions and memory, from what its kernel and firmware say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from mosaic_core.words.finding import Finding, failed, passed, skipped, warned

BoardKind = Literal["raspberry-pi", "jetson", "x86"]

_UNDERVOLTAGE, _CAPPED, _THROTTLED, _SOFT_LIMIT = 1, 2, 4, 8
_SINCE_BOOT_SHIFT = 16
"""Bits of the Raspberry Pi's ``get_throttled``: the same four again, 16 higher, for ever since it was started."""
PI_SOFT_LIMIT_C = 80.0
"""From here on the firmware of a Raspberry Pi lowers its clock (its documentation, on frequency and heat)."""
NEAR_LIMIT_C = 5.0
PLAUSIBLE_TRIP_C = (40.0, 150.0)
"""Boards declare trip points of 0 or of thousands of degrees where they mean none."""
LEAST_AVAILABLE_BYTES = 256 * 1024**2
"""An idle robot takes 70 MB, a camera that is encoded and a recorder several times that."""
_MOST_NAMED = 4
_SCALING_BY_ITSELF = frozenset({"intel_pstate", "amd-pstate-epp"})
"""Drivers for which ``powersave`` means that the processor chooses its clock itself, as ``schedutil`` does."""


@dataclass(frozen=True, slots=True)
class Board:
    """A machine, by the model that its firmware names; an unnamed one counts as a PC."""

    model: str

    @property
    def kind(self) -> BoardKind:
        if self.model.startswith("Raspberry Pi"):
            return "raspberry-pi"
        return "jetson" if "jetson" in self.model.lower() else "x86"

    @property
    def page(self) -> str:
        """The page of the documentation about such machines."""
        return f"docs/howto/{self.kind}.md"


def _see(cure: str, board: Board) -> str:
    return f"{cure} See {board.page}."


def model_finding(board: Board) -> Finding:
    """The model, and which page is about it."""
    if not board.model:
        return skipped("machine.model", "The firmware does not tell the model.")
    return passed("machine.model", f"{board.model}; its page is {board.page}.", model=board.model, page=board.page)


def power_finding(bits: int | None, board: Board) -> Finding:
    """Judge a Raspberry Pi's ``get_throttled``; too little voltage now is a failure: the board may restart at any
    moment."""
    check = "machine.power"
    if bits is None:
        return skipped(check, "This machine does not tell whether it was throttled.")
    facts = {"throttled": hex(bits)}
    now, ever = bits & 0xF, (bits >> _SINCE_BOOT_SHIFT) & 0xF
    volts = _see("Use the supply made for this board, a short thick cable, and power motors from another one.", board)
    cool = _see("Give it a heat sink, a fan and air; lower the cameras' size or rate.", board)
    if now & _UNDERVOLTAGE:
        return failed(check, "check.undervoltage", "The supply gives too little voltage at this moment.", volts, facts)
    if now & (_CAPPED | _THROTTLED | _SOFT_LIMIT):
        return warned(check, "check.throttled", "The firmware holds the clock down at this moment.", cool, facts)
    if ever & _UNDERVOLTAGE:
        text = "The supply gave too little voltage at some time since the start."
        return warned(check, "check.undervoltage", text, volts, facts)
    if ever:
        text = "The firmware held the clock down at some time since the start."
        return warned(check, "check.throttled", text, cool, facts)
    return passed(check, "Never throttled, never short of voltage since the start.", **facts)


@dataclass(frozen=True, slots=True)
class ThermalZone:
    """One sensor: its name, what it measures, and from where on the kernel acts (passive, hot and critical trips)."""

    name: str
    temperature_c: float
    trips_c: tuple[float, ...] = ()

    def limit_c(self, board: Board) -> float | None:
        low, high = PLAUSIBLE_TRIP_C
        limits = [trip for trip in self.trips_c if low <= trip <= high]
        if board.kind == "raspberry-pi":
            limits.append(PI_SOFT_LIMIT_C)
        return min(limits, default=None)

    def room_c(self, board: Board) -> float:
        """How far it may still rise; infinite where no limit is known."""
        limit_c = self.limit_c(board)
        return float("inf") if limit_c is None else limit_c - self.temperature_c


def heat_finding(zones: Sequence[ThermalZone], board: Board) -> Finding:
    """Judge the zone that is nearest to its limit."""
    check = "machine.temperature"
    if not zones:
        return skipped(check, "No temperature sensor is known to the kernel.")
    facts = {"zones": {one.name: round(one.temperature_c, 1) for one in zones}}
    nearest = min(zones, key=lambda one: (one.room_c(board), -one.temperature_c))
    limit_c = nearest.limit_c(board)
    shown = f"{nearest.name} is at {nearest.temperature_c:.0f} °C"
    if limit_c is None:
        return passed(check, f"{shown}; no limit is known.", **facts)
    if nearest.room_c(board) < NEAR_LIMIT_C:
        text = f"{shown}; from {limit_c:.0f} °C on the clock is held down."
        return warned(check, "check.hot", text, _see("Cool it, or give it less to do.", board), facts)
    return passed(check, f"{shown}, {nearest.room_c(board):.0f} °C below its limit.", **facts)


def governor_finding(governors: Sequence[tuple[str, str]], board: Board) -> Finding:
    """Judge the pairs of driver and governor of all clock domains."""
    check = "machine.governor"
    if not governors:
        return skipped(check, "The kernel does not scale the processor's clock.")
    facts = {"governors": [f"{governor} ({driver})" for driver, governor in governors]}
    if any(governor == "powersave" and driver not in _SCALING_BY_ITSELF for driver, governor in governors):
        text = "The governor `powersave` keeps the processor at its lowest clock."
        cure = "`echo schedutil | sudo tee /sys/devices/system/cpu/cpufreq/policy*/scaling_governor`."
        return warned(check, "check.slow_governor", text, _see(cure, board), facts)
    names = ", ".join(dict.fromkeys(governor for _, governor in governors))
    return passed(check, f"The processor's clock is governed by {names}.", **facts)


def wifi_finding(power_save: Mapping[str, bool | None], board: Board) -> Finding:
    """Judge wireless interfaces that are up; ``None``: nobody tells of this one."""
    check = "machine.wifi"
    if not power_save:
        return skipped(check, "No wireless interface is up.")
    saving = [name for name, is_on in power_save.items() if is_on]
    unknown = [name for name, is_on in power_save.items() if is_on is None]
    facts = {"powerSave": dict(power_save)}
    if saving:
        text = f"{', '.join(saving)} sleeps between packets (power save): commands wait for it."
        cure = f"`sudo iw dev {saving[0]} set power_save off`, and in NetworkManager `802-11-wireless.powersave 2`."
        return warned(check, "check.wifi_power_save", text, _see(cure, board), facts)
    if unknown:
        text = f"Nobody tells whether {', '.join(unknown)} saves power."
        return skipped(check, text, "`sudo apt install iw`.", **facts)
    return passed(check, f"{', '.join(power_save)} does not sleep between packets.", **facts)


@dataclass(frozen=True, slots=True)
class DeviceAccess:
    """A device file: the group that may use it, whether this process may, and whether the account was added since."""

    path: str
    group: str
    is_usable: bool
    is_listed: bool = False


def access_finding(devices: Sequence[DeviceAccess], board: Board) -> Finding:
    """Judge what this account may open, among files of groups that it could be in."""
    check = "machine.groups"
    shut = [one for one in devices if not one.is_usable]
    facts = {"closed": {one.path: one.group for one in shut}}
    if not devices:
        return skipped(check, "No cameras, serial lines or buses are here that belong to a group.")
    if not shut:
        groups = ", ".join(sorted({one.group for one in devices}))
        return passed(check, f"This account may use the devices of: {groups}.", **facts)
    missing = sorted({one.group for one in shut if not one.is_listed})
    cure = f"`sudo usermod -aG {','.join(missing)} $USER`, then log in again." if missing else "Log in again."
    paths = ", ".join(one.path for one in shut[:_MOST_NAMED]) + (" and others" if len(shut) > _MOST_NAMED else "")
    return warned(check, "plugin.no_permission", f"This account may not use {paths}.", _see(cure, board), facts)


def memory_finding(available_bytes: int | None, total_bytes: int | None, board: Board) -> Finding:
    """Judge what programs may still take before others are ended."""
    check = "machine.memory"
    if available_bytes is None or total_bytes is None:
        return skipped(check, "The kernel does not tell its memory.")
    facts = {"availableBytes": available_bytes, "totalBytes": total_bytes}
    shown = f"{available_bytes // 1024**2} of {total_bytes // 1024**2} MiB of memory are available"
    if available_bytes < LEAST_AVAILABLE_BYTES:
        cure = _see("End other programs (a desktop takes the most), and lower the cameras' size.", board)
        return warned(check, "check.low_memory", f"Only {shown}.", cure, facts)
    return passed(check, f"{shown}.", **facts)


def clock_finding(is_synchronized: bool | None, board: Board) -> Finding:
    """Judge whether something keeps this machine's clock right; a board without a battery starts in the past."""
    check = "machine.clock"
    if is_synchronized is None:
        return skipped(check, "Nobody tells whether the clock is kept right.")
    if not is_synchronized:
        cure = _see("`sudo timedatectl set-ntp true`, and let UDP port 123 out.", board)
        return warned(check, "check.clock_not_synchronized", "Nothing keeps this machine's clock right.", cure)
    return passed(check, "The clock is kept right from the network.")
