"""The bus over DDS: one participant for all connectors of a robot that are in the same domain."""

from __future__ import annotations

import logging
import os
import socket
import threading
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.dynamic import get_types_for_typeid
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from mosaic_ros2.bus.bus import BusError, HeardEndpoint
from mosaic_ros2.bus.dds.dds_service import DdsServiceCaller
from mosaic_ros2.bus.dds.dds_topics import DdsPublication, DdsSubscription
from mosaic_ros2.bus.dds.discovery import Discovery
from mosaic_ros2.bus.dds.network import configuration, why_not_joined
from mosaic_ros2.bus.dds.wire_types import WireTypes, definitions_of
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.bus.ros_names import topic_of
from mosaic_ros2.definitions.definition import DefinitionError
from mosaic_ros2.definitions.type_book import TypeBook

_log = logging.getLogger(__name__)

TYPE_TIMEOUT_S = 2.0
"""Asking a publisher for the definition of its type takes a few round trips."""
_domains: dict[int, Any] = {}
"""The domains that this process has configured: Cyclone takes one configuration for each, until the process ends."""


class DdsBus:
    """Joins a DDS domain. The participant is made when it is needed first, and again after a failure."""

    def __init__(self, domain: int, book: TypeBook, interface: str = "", peers: tuple[str, ...] = ()) -> None:
        self.domain = domain
        self.where = f"DDS, domain {domain}" + (f", interface {interface}" if interface else "")
        self._book = book
        self._network = (interface, peers)
        self._types = WireTypes(book)
        self._lock = threading.Lock()
        self._participant: Any = None
        self._discovery: Discovery | None = None

    def _joined(self) -> tuple[Any, Discovery]:
        with self._lock:
            if self._participant is None or self._discovery is None:
                try:
                    self._configure()
                    self._participant = DomainParticipant(self.domain)
                    self._discovery = Discovery(self._participant)
                except DDSException as error:
                    there = [name for _, name in socket.if_nameindex()]
                    what, cure = why_not_joined(self._network[0], there, error.msg)
                    raise BusError(f"can't join {self.where}: {what}", cure) from error
            return self._participant, self._discovery

    def _configure(self) -> None:
        text = configuration(*self._network, os.environ)
        if self.domain in _domains:
            return
        try:
            _domains[self.domain] = Domain(self.domain, text)
        except DDSException as error:
            if error.code == DDSException.DDS_RETCODE_PRECONDITION_NOT_MET:
                _log.warning("%s: another part of this program has configured this domain already", self.where)
                return
            alone = configuration(*self._network, {**os.environ, "CYCLONEDDS_URI": ""})
            if alone in (text, configuration("", (), {})):
                raise
            # Cyclone takes no interface twice, and CYCLONEDDS_URI may name one too.
            _domains[self.domain] = Domain(self.domain, alone)
            _log.warning("%s: CYCLONEDDS_URI does not go together with the connector's params, which win", self.where)

    def endpoints(self) -> list[HeardEndpoint]:
        return self._joined()[1].endpoints()

    def subscribe(self, topic: str, type_name: str, qos: QosProfile) -> DdsSubscription:
        return DdsSubscription(*self._topic(topic_of(topic), type_name), qos)

    def publish(self, topic: str, type_name: str, qos: QosProfile) -> DdsPublication:
        return DdsPublication(*self._topic(topic_of(topic), type_name), qos)

    def caller(self, service: str, type_name: str) -> DdsServiceCaller:
        return DdsServiceCaller(service, self._topic, type_name, self.endpoints)

    def _topic(self, topic: str, type_name: str) -> tuple[Any, Any]:
        participant, _ = self._joined()
        struct = self._types.of(type_name)
        try:
            return participant, Topic(participant, topic, struct)
        except DDSException as error:
            cure = "give one topic one type in all connectors"
            raise BusError(f"{topic} can't be used as {type_name}: {error.msg}", cure) from error

    def learn_type(self, topic: str) -> str:
        participant, discovery = self._joined()
        for sample, is_writer in discovery.samples():
            if is_writer and sample.topic_name == topic_of(topic) and sample.type_id is not None:
                try:
                    struct, _ = get_types_for_typeid(participant, sample.type_id, duration(seconds=TYPE_TIMEOUT_S))
                    definitions = definitions_of(struct)
                except (DDSException, DefinitionError):
                    continue
                self._book.add(*(one for one in definitions if not self._book.knows(one.name)))
                return definitions[0].name
        return ""

    def close(self) -> None:
        with self._lock:
            self._discovery, self._participant = None, None
