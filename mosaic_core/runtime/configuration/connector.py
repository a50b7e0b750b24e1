"""Declares a built connector: what its YAML entry became, ready for the robot to run."""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.config import ConnectorConfig, SafetyConfig
from mosaic_core.words.data_type import Delivery


@dataclass(frozen=True, slots=True)
class Connector:
    """A connector with its handlers. ``safety`` and ``terms`` are the effective ones: what the YAML file says,
    or else the connector's own defaults; ``safety.timeout_s`` overrides the handler's ``timeout_s`` when set."""

    config: ConnectorConfig
    handlers: tuple[Handler, ...]
    entry: CatalogueEntry
    safety: SafetyConfig
    terms: DeliveryTerms

    @property
    def delivery(self) -> Delivery:
        return self.terms.mode
