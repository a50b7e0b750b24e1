"""Whatever handlers a connector has, each of them is told to operators once, with what it would say alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.messages import BatteryState, JointTarget
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.runtime.configuration.connector import handler_groups
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract


class Sends(DataChannelSendable[BatteryState]):
    widget = "battery"


class Takes(DataChannelJsonReceivable):
    timeout_s = 1.0
    delivery = Delivery.LATEST

    def handle_data(self, data: dict[str, Any]) -> None:
        """Takes it."""

    def make_safe(self, cause: str) -> None:
        """Nothing moves."""


class Sees(MediaTrackHandler):
    """A camera."""


class Hears(AudioTrackHandler):
    """A microphone."""


class Speaks(AudioReceivable):
    """A loudspeaker."""


class Part(Sends):
    is_part = True


class OtherPart(Takes):
    is_part = True


class Hidden(Sends):
    is_for_originals = True


ALONE = [Sends, Takes, Sees, Hears, Speaks]
KINDS = st.lists(st.sampled_from([*ALONE, Part, OtherPart, Hidden]), min_size=1, max_size=8)
CONTRACTS = st.sampled_from([None, *(DeliveryContract(mode=mode) for mode in Delivery)])
LABEL = "device"


def made(kinds: Sequence[type[Handler]]) -> list[Handler]:
    return [kind(f"{LABEL}_{number}") for number, kind in enumerate(kinds)]


@given(KINDS)
def test_every_handler_is_in_exactly_one_group(kinds: Sequence[type[Handler]]) -> None:
    handlers = made(kinds)
    groups = handler_groups(LABEL, handlers)
    grouped = [handler for group in groups for handler in group.handlers]
    assert len(grouped) == len(handlers)
    assert set(grouped) == set(handlers)
    assert all(group.handlers for group in groups)
    told = [group for group in groups if any(not one.is_for_originals for one in group.handlers)]
    assert [*told, *(group for group in groups if group not in told)] == [*groups]
    for group in told:
        its = [one for one in group.handlers if not one.is_for_originals]
        assert group.label == LABEL if its[0].is_part else [group.label] == [one.label for one in its]


@given(st.lists(st.sampled_from(ALONE), min_size=1, max_size=8), CONTRACTS)
def test_each_says_what_it_would_say_alone(kinds: Sequence[type[Handler]], wanted: DeliveryContract | None) -> None:
    handlers = made(kinds)
    apart = [entry for one in handlers for entry in catalogue_entries(one.label, "acme", [one], delivery=wanted)]
    entries = catalogue_entries(LABEL, "acme", handlers, delivery=wanted)
    assert [one.model_copy(update={"connector": None}) for one in entries] == apart
    assert {one.connector for one in entries} == {LABEL if len(handlers) > 1 else None}
    assert [entry.label for entry in apart] == [handler.label for handler in handlers]


@given(KINDS, CONTRACTS)
def test_tracks_have_no_channels_and_channels_are_all_told(
    kinds: Sequence[type[Handler]], wanted: DeliveryContract | None
) -> None:
    handlers = made(kinds)
    entries = catalogue_entries(LABEL, "acme", handlers, delivery=wanted)
    tracks = [entry for entry in entries if entry.data_type is MosaicDataType.MEDIA]
    assert [one.label for one in tracks] == [one.label for one in handlers if one.data_type is MosaicDataType.MEDIA]
    assert all(entry.channels == () and entry.delivery is Delivery.LATEST for entry in tracks)
    channels = {channel.label for entry in entries for channel in entry.channels}
    told = [one for one in handlers if one.data_type is not MosaicDataType.MEDIA and not one.is_for_originals]
    assert channels == {one.label for one in told}


def test_parts_are_one_entry_of_both_directions_under_the_label_of_their_connector() -> None:
    camera, *parts = made([Sees, Part, OtherPart])
    first, second = catalogue_entries(LABEL, "acme", [camera, *parts])
    assert (first.label, first.data_type) == (camera.label, MosaicDataType.MEDIA)
    assert (second.label, second.direction, second.widget) == (LABEL, Direction.BOTH, "battery")
    assert [channel.label for channel in second.channels] == [one.label for one in parts]
    assert second.safety == {"timeout_s": 1.0}


class TakesJoints(DataChannelReceivable[JointTarget]):
    def __init__(self, label: str, joints: Sequence[str]) -> None:
        super().__init__(label)
        self.item_names = tuple(joints)

    def handle_data(self, data: JointTarget) -> None:
        """Takes it."""


def test_the_joints_that_a_command_may_name_are_told_where_they_are_known() -> None:
    handlers = [TakesJoints("arm", ["base", "lift"]), TakesJoints("any", []), Sends("battery")]
    entries = catalogue_entries(LABEL, "acme", handlers)
    assert [entry.item_names for entry in entries] == [("base", "lift"), None, None]
    assert entries[0].short().item_names == ("base", "lift")
