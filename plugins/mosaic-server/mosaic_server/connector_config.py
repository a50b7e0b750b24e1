"""``connectorConfig``, in which original dashboards read what a robot has: a JSON text with a list of connectors.

``{"connectors": [{"connectorId", "connectorType", "params"?: {"parallelNum"?}}]}``; ``connectorType`` names a store of
the original dashboard. It is derived from the catalogue of a robot of ours; a robot that announces none is described by
people, or by a dashboard of ours. Pure.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.data_type import Kind, MosaicDataType
from mosaic_core.words.wire_model import to_json

MAX_LENGTH = 500_000
"""Characters of a description that is kept."""
MAX_CONNECTORS = 1000
MAX_ID_LENGTH = 200
_DRIVES = ("cmd-vel", "cmd_vel", "twist")


class BadConnectorConfig(ValueError):
    """The text describes no connectors; the message says why."""


def derived_connector_config(catalogue: Catalogue) -> str:
    """What original dashboards can show and drive of this robot. Connectors for which they have no store are left
    out: one that they don't know would stop their page."""
    return to_json({"connectors": [one for entry in catalogue.entries for one in _connectors(entry)]})


def checked_connector_config(text: str) -> str:
    """The text as it came, if it is a description; raises :class:`BadConnectorConfig`. Keys of others stay in it."""
    try:
        described = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise BadConnectorConfig(f"connectorConfig is no JSON text: {error}") from error
    connectors = described.get("connectors") if isinstance(described, dict) else None
    if not isinstance(connectors, list):
        raise BadConnectorConfig('connectorConfig has no list of connectors: {"connectors": [{"connectorId": …}, …]}')
    if len(connectors) > MAX_CONNECTORS:
        raise BadConnectorConfig(f"connectorConfig has more than {MAX_CONNECTORS} connectors")
    for place, connector in enumerate(connectors):
        _must_name_itself(connector, place)
    return text


def _must_name_itself(connector: Any, place: int) -> None:
    connector_id = connector.get("connectorId") if isinstance(connector, dict) else None
    if not isinstance(connector_id, str) or not 0 < len(connector_id) <= MAX_ID_LENGTH:
        raise BadConnectorConfig(
            f"connectors[{place}] has no connectorId: the connector's label, of 1 to {MAX_ID_LENGTH} characters"
        )


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is no JSON")


def _connectors(entry: CatalogueEntry) -> Iterator[dict[str, Any]]:
    if entry.type == "connection-check":
        # The dashboard sends where the robot receives, and the other way round (UPSTREAM §5.3).
        yield _connector(f"{entry.label}-receiver", "ConnectionCheckSenderStore")
        yield _connector(f"{entry.label}-sender", "ConnectionCheckReceiverStore")
    elif entry.widget == "point-cloud":
        # Original dashboards get clouds on channels of their own, and whichever is open carries all of them.
        yield _connector(entry.label, "PointCloudStore", params={"parallelNum": 1})
    elif (store := _store(entry)) is not None:
        yield _connector(entry.label, store)


def _connector(connector_id: str, connector_type: str, **more: Any) -> dict[str, Any]:
    return {"connectorId": connector_id, "connectorType": connector_type, **more}


def _store(entry: CatalogueEntry) -> str | None:
    """The original dashboard's store for a connector of one channel."""
    if entry.kind is not Kind.DATA or entry.data_type is MosaicDataType.MEDIA:
        return "MediaStreamStore" if entry.kind is Kind.VIDEO else None  # it has no sound
    if entry.data_type in (MosaicDataType.JSON_R2U, MosaicDataType.JSON_BI) or entry.widget == "laser-scan":
        return "JsonReceivableStore"  # scans go to original dashboards as JSON, in whichever form ours get them
    if entry.data_type is MosaicDataType.STRING_R2U:
        return "StringReceivableStore"
    return _pad(entry) if entry.data_type is MosaicDataType.JSON_U2R else None


def _pad(entry: CatalogueEntry) -> str | None:
    safety = entry.safety or {}
    if entry.type == "h1-direction":
        return "H1DirectionSenderStore"
    if entry.widget != "drive-pad" and not any(word in entry.type.lower() for word in _DRIVES):
        return None
    # A stick repeats itself while it is held, as a robot with a time-out needs it; buttons send once per click.
    return "ThumbstickToTwistStore" if safety.get("timeout_s") else "Ros2WasdToTwistStore"
