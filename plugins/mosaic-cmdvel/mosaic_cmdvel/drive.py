"""Drives: what turns a velocity into motion. An entry point of the group ``mosaic.drives`` names a :class:`Drive`.

The entry point's name is the ``type`` under ``params.drive`` of a ``cmd-vel`` connector.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import ClassVar, Generic, Self, TypeVar, get_args, get_origin

from pydantic import Field

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.params import Params
from mosaic_core.messages import Twist


class DriveParams(Params):
    """Base of a drive's params: what stands under ``params.drive``."""

    type: str = Field(description="The drive: the name of an entry point of the group mosaic.drives.")


P = TypeVar("P", bound=DriveParams)


class Drive(ABC, Generic[P]):
    """A base that can be moved. Derive as ``class MyDrive(Drive[MyParams])``.

    The constructor opens nothing. ``with drive:`` opens the device; if that raises, the connector reports it and
    tries again with back-off, on the same object, while the robot goes on. An exception of :meth:`apply` or
    :meth:`stop` counts as loss of the device: it is closed and opened again.

    Commands come already clamped to the limits of ``safety``, never NaN or infinite.
    """

    params_model: ClassVar[type[DriveParams]] = DriveParams
    """Taken from the type argument."""

    def __init__(self, params: P, shared: Shared) -> None:
        """``shared`` is the robot's: ``shared.get(key, make)`` gives what several connectors use together. Get it
        here: what is there before the robot starts is opened before this drive and closed after it."""
        self.params = params
        self.shared = shared

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        for base in getattr(cls, "__orig_bases__", ()):
            origin = get_origin(base)
            if isinstance(origin, type) and issubclass(origin, Drive):
                argument = get_args(base)[0]
                if isinstance(argument, type) and issubclass(argument, DriveParams):
                    cls.params_model = argument

    def __enter__(self) -> Self:
        """Open the device. May block for a while: it runs on a thread of its own."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the device; :meth:`stop` was called before."""

    @abstractmethod
    def apply(self, twist: Twist) -> None:
        """Move like this until told otherwise. Runs on the receiver's thread.

        Raise :class:`~mosaic_core.contract.handler.Refused` to refuse just this command.
        """

    @abstractmethod
    def stop(self) -> None:
        """Stand still. Any thread, at any time, also while :meth:`apply` runs or hangs: be quick, take no lock that
        ``apply`` holds for long, and be prepared to be called twice."""
