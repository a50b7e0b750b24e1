"""Refuses what is no sound, with the line of the code that sends it."""

from __future__ import annotations

from typing import Any

from mosaic_core.contract.declared.code_lines import caller
from mosaic_core.contract.declared.wrong_declaration import wrong_message
from mosaic_core.contract.declared.yielded import kind_of
from mosaic_core.contract.sound import Sound

_RATES_HZ = range(4_000, 384_001)


def check_sound(handler: type, sound: object) -> None:
    """Raise :class:`MosaicError` (``plugin.wrong_message``) for what nobody could hear."""
    mistake = sound_mistake(sound)
    if mistake:
        raise wrong_message(handler.__qualname__, caller(), f"sends {mistake}")


def sound_mistake(sound: object) -> str:
    """What is wrong with it; empty if it is a sound."""
    if not isinstance(sound, Sound):
        return f"{kind_of(sound)}, and no `Sound(samples, rate_hz, captured_at_s)`"
    samples: Any = sound.samples
    shape: tuple[int, ...] = getattr(samples, "shape", ())
    if str(getattr(samples, "dtype", "")) != "int16" or len(shape) != 2 or shape[1] < 1:
        return f"a sound of {kind_of(samples)}; it must be int16 samples of shape (n, channels)"
    if not _RATES_HZ.start <= sound.rate_hz < _RATES_HZ.stop:
        return f"a sound whose rate of {sound.rate_hz} Hz is out of range (4000 to 384000)"
    return ""
