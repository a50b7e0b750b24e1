"""Holds one connector type under examination: its class, loaded once, and connectors made of it with its own params."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint
from typing import Any

from pydantic import BaseModel

from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.declared.nested_models import models_in
from mosaic_core.contract.example import example_of
from mosaic_core.contract.handler import DataChannelReceivable, Handler, message_type_of
from mosaic_core.contract.params import CameraLabel, DataLabel
from mosaic_core.contract.request_handler import RequestHandler, answer_type_of
from mosaic_core.laboratory.joining import checked_config, configured_with, connector
from mosaic_core.ladder.fault import Fault, NotJudged
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.source_places import line_of_entry, place_of_class, place_of_error, trace_of
from mosaic_core.ladder.stand_ins import StandInCameraConfigurer, StandInChannelConfigurer
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.configuration.handler_problems import named_in
from mosaic_core.runtime.threads.slow_code import told_when_slow
from mosaic_core.words.errors import CodeLine, MosaicError

LABEL = "examined"
_MAX_DEPTH = 8


class Examinee:
    """One connector type of a shipment. ``restarts``: how often a rule about restarts restarts it. ``tell``: as for
    :func:`told_when_slow`."""

    def __init__(
        self,
        shipment: Shipment,
        entry_point: EntryPoint,
        *,
        restarts: int = 100,
        tell: Callable[[str], object] | None = None,
    ) -> None:
        self.shipment = shipment
        self.entry_point = entry_point
        self.restarts = restarts
        self._tell = tell

    @property
    def connector_type(self) -> str:
        return self.entry_point.name

    @cached_property
    def loaded(self) -> object | Fault:
        """What the entry point names, or the fault with which its import ended."""
        if not self.entry_point.pattern.match(self.entry_point.value):
            return Fault(f"its entry point is '{self.entry_point.value}', which is no module:Class", self.entry_place)
        try:
            with told_when_slow(f"the import of connector type '{self.connector_type}'", self._tell):
                loaded: object = self.entry_point.load()
        except (Exception, SystemExit) as error:  # noqa: BLE001 - an import may fail in any way
            place = place_of_error(error)
            if isinstance(error, MosaicError):  # what a class declares, told with its place and cure
                return Fault(str(error).removeprefix(f"{place}: "), place if place.file else self.entry_place)
            message = f"importing {self.entry_point.value} raises {type(error).__name__}: {error}"
            return Fault(message, place if place.file else self.entry_place, trace_of(error))
        return loaded

    @property
    def entry_place(self) -> CodeLine:
        """Where the entry point is written."""
        tree = self.shipment.tree
        if tree is None:
            return CodeLine(self.shipment.source)
        return line_of_entry(tree / "pyproject.toml", self.entry_point)

    @property
    def configurer(self) -> type[Configurer[Any]]:
        """Raises :class:`NotJudged` where there is none."""
        loaded = self.loaded
        if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
            raise NotJudged("its configurer can't be loaded")
        if getattr(loaded, "__abstractmethods__", ()):
            raise NotJudged("its configurer is not complete")
        return loaded

    @property
    def place(self) -> CodeLine:
        return place_of_class(self.configurer)

    @property
    def example(self) -> dict[str, Any]:
        """The params of its documented example."""
        return dict(example_of(self.connector_type, self.configurer).get("params", {}))

    @property
    def trial(self) -> dict[str, Any]:
        """The params with which it runs on any machine; those of the example where its author names no others."""
        told = self.configurer.trial
        return self.example if told is None else dict(told)

    def configured(self, params: Mapping[str, Any], safety: Mapping[str, Any] | None = None) -> Configured:
        """A robot with this one connector, and a camera or data channel for each that it names. Raises
        :class:`ConfigError`."""
        one = connector(self.configurer, label=LABEL, params=params, safety=safety)
        (alone,) = checked_config([one]).connectors
        cameras = dict.fromkeys(label for _, label in named_in(alone.params, CameraLabel))
        channels = dict.fromkeys(label for _, label in named_in(alone.params, DataLabel))
        beside = [connector(StandInCameraConfigurer, label=label) for label in cameras]
        beside += [connector(StandInChannelConfigurer, label=label) for label in channels]
        return configured_with([one, *beside])

    def connector(self, params: Mapping[str, Any]) -> Connector:
        """The connector itself, without what stands beside it. Raises :class:`ConfigError`."""
        return self.configured(params).connectors[0]

    @cached_property
    def handlers(self) -> tuple[Handler, ...]:
        """Those that it makes with the params of its trial, to look at. Raises :class:`NotJudged`."""
        try:
            made = self.connector(self.trial)
        except NotJudged:
            raise
        except Exception as error:
            raise NotJudged(f"it can't be configured ({error})") from error
        return made.handlers

    def receivers(self) -> list[DataChannelReceivable[Any]]:
        return [one for one in self.handlers if isinstance(one, DataChannelReceivable)]

    def message_models(self) -> list[type[BaseModel]]:
        """Every model of its messages, also those inside others."""
        roots = [message_type_of(type(one)) for one in self.handlers]
        roots += [answer_type_of(type(one)) for one in self.handlers if isinstance(one, RequestHandler)]
        return list(dict.fromkeys(model for root in roots for model in models_within(root)))

    def param_models(self) -> list[type[BaseModel]]:
        """The model of its params, and those inside it."""
        return list(dict.fromkeys(models_within(self.configurer.params_model)))

    def fault(self, error: BaseException, what: str) -> Fault:
        """An error of its code as a fault."""
        message = f"{what} {type(error).__name__}: {error}"
        place = place_of_error(error, self.shipment.packages())
        return Fault(message, place if place.file else self.place, trace_of(error))


def models_within(annotation: Any, depth: int = 0) -> Iterator[type[BaseModel]]:
    """The pydantic models that a type is made of."""
    if depth > _MAX_DEPTH:
        return
    for model in models_in(annotation):
        yield model
        for info in model.model_fields.values():
            yield from models_within(info.annotation, depth + 1)
