"""Opens devices of gpiozero on the pins of this machine, or on pins that are made up."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

from pydantic import Field

from mosaic_core import DeviceGone
from mosaic_core.contract.params import Params

Source = Literal["gpio", "fake"]
_ONE_AT_A_TIME = threading.Lock()
"""The filters of warnings are one for all threads: pins that open side by side would put back each other's."""


class PinParams(Params):
    """What all pins have in common."""

    pin: int = Field(
        ge=0, le=53, description="The number that Broadcom gave it, GPIO17 is 17: not its place on the board."
    )
    source: Source = Field(default="gpio", description="`gpio`, or `fake`: pins that are made up, to try it.")

    @property
    def place(self) -> str:
        """How errors call it."""
        return f"GPIO{self.pin}"


def factory_of(source: Source) -> Any:
    """What gpiozero makes pins of: what it finds on this machine, or GPIOZERO_PIN_FACTORY names."""
    if source == "gpio":
        from gpiozero import Device
        from gpiozero.exc import PinFactoryFallback

        with _ONE_AT_A_TIME, warnings.catch_warnings():
            warnings.simplefilter("ignore", PinFactoryFallback)  # that none is left is told, with the cure
            Device.ensure_pin_factory()
        return Device.pin_factory
    from gpiozero.pins.mock import MockFactory, MockPWMPin

    return MockFactory(pin_class=MockPWMPin)


@contextmanager
def opening(params: PinParams) -> Iterator[None]:
    """Whatever fails in the block is :class:`DeviceGone` with its cure: no way to the pins, a pin that somebody has."""
    from gpiozero import exc

    try:
        yield
    except exc.BadPinFactory as error:
        cure = "On a Raspberry Pi: pip install lgpio. Elsewhere there are no pins; `source: fake` makes some up."
        raise DeviceGone(f"{params.place}: no way to the pins of this machine ({error})", cure) from error
    except exc.GPIOPinInUse as error:
        raise DeviceGone(f"{params.place} is in use: {error}", "Give each pin to one connector.") from error
    except (exc.PinUnsupported, exc.PinPWMError) as error:
        cure = "Take lgpio (pip install lgpio), and for a dimmed output a pin that can."
        raise DeviceGone(f"{params.place} can't do this: {error}", cure) from error
    except exc.PinError as error:
        raise DeviceGone(f"{params.place} can't be had: {error}", "Look at its number.") from error
    except Exception as error:  # each factory raises errors of its own library
        cure = "Does another program hold it (gpioinfo), and are you in the group gpio?"
        raise DeviceGone(f"{params.place}: {type(error).__name__}: {error}", cure) from error
