"""Which channels a connector gets: by the robot's catalogue, by what people described, or by what the caller says."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.operator.stores.channel_plan import (
    Known,
    PlannedChannel,
    UnknownLabel,
    answer_patience_s,
    check_plan_of,
    make_store,
    media_labels_of,
    naming,
    plan_of,
    resource_of,
    sound_store,
)
from mosaic_core.operator.stores.media_store import MediaStreamStore, SoundStore, VoiceStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import BidirectionalStore, ReceivableStore, SendableStore
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry, ChannelEntry
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConnectionFailed

ROBOT = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
J = MosaicDataType


def entry(label: str, data_type: MosaicDataType, *, channels: tuple[ChannelEntry, ...] = (), **more: Any) -> Any:
    return CatalogueEntry(
        label=label,
        **({"type": label, "direction": data_type.direction} | more),
        data_type=data_type,
        channels=channels,
    )


CHECK = entry(
    "link", J.STRING_U2R, type="connection-check", direction=Direction.BOTH,
    channels=(
        ChannelEntry(label="link-receiver", data_type=J.STRING_U2R),
        ChannelEntry(label="link-sender", data_type=J.STRING_R2U),
    ),
)  # fmt: skip
CATALOGUE = Catalogue.of([
    entry("battery", J.JSON_R2U, delivery=Delivery.LATEST),
    entry("base", J.JSON_U2R, delivery=Delivery.LATEST, safety={"requires_lease": True}),
    entry("arm", J.JSON_U2R, delivery=Delivery.RELIABLE, safety={"requires_lease": True, "resource": "arm"}),
    entry("notes", J.JSON_BI, delivery=Delivery.RELIABLE),
    entry("horn", J.JSON_U2R, delivery=Delivery.RELIABLE, safety={"max_rate_hz": 2}),
    entry("front", J.MEDIA, kind=Kind.VIDEO),
    entry("ears", J.MEDIA, kind=Kind.AUDIO),
    entry("voice", J.MEDIA, kind=Kind.AUDIO, direction=Direction.TO_ROBOT),
    CHECK,
])  # fmt: skip
ANNOUNCED, DESCRIBED, NOTHING = Known(CATALOGUE), Known(CATALOGUE, is_told=True), Known(None)


def of(label: str, data_type: MosaicDataType | None = None) -> RobotConnector:
    return RobotConnector(ROBOT, label, data_type)


@pytest.mark.parametrize(
    ("label", "planned"),
    [
        ("battery", PlannedChannel("battery", Delivery.LATEST, sends=False)),
        ("base", PlannedChannel("base", Delivery.LATEST, sends=True, resource="motion")),
        ("arm", PlannedChannel("arm", Delivery.RELIABLE, sends=True, resource="arm")),
        ("notes", PlannedChannel("notes", Delivery.RELIABLE, sends=True, may_wait=True)),
        ("horn", PlannedChannel("horn", Delivery.RELIABLE, sends=True)),
    ],
)
def test_a_channel_is_as_the_catalogue_says_and_what_moves_something_never_waits(
    label: str, planned: PlannedChannel
) -> None:
    assert plan_of(of(label), ANNOUNCED).channels == (planned,)


def test_a_camera_has_no_channel() -> None:
    plan = plan_of(of("front"), ANNOUNCED)
    assert (plan.data_type, plan.channels) == (J.MEDIA, ())


def test_a_connector_of_several_channels_is_served_whole_or_by_one_of_them() -> None:
    assert [channel.label for channel in plan_of(of("link"), ANNOUNCED).channels] == ["link-receiver", "link-sender"]
    single = plan_of(of("link-sender"), ANNOUNCED)
    assert (single.data_type, [(one.label, one.sends) for one in single.channels]) == (
        J.STRING_R2U,
        [("link-sender", False)],
    )


def test_an_unknown_label_names_what_there_is_and_the_nearest() -> None:
    with pytest.raises(UnknownLabel, match="did you mean 'battery'") as caught:
        plan_of(of("batery"), ANNOUNCED)
    assert caught.value.nearest == "battery"
    assert "link-sender" in caught.value.message


def test_where_people_described_the_robot_the_cure_is_to_say_what_it_is() -> None:
    with pytest.raises(UnknownLabel, match="Nobody has described a connector 'nothing-like-it'") as caught:
        plan_of(of("nothing-like-it"), DESCRIBED)
    assert "name the data type" in caught.value.cure


def test_where_nothing_is_known_a_data_type_is_asked_for_and_enough() -> None:
    with pytest.raises(ConnectionFailed, match="Nothing is known about 'x'"):
        plan_of(of("x"), NOTHING)
    assert plan_of(of("x", J.JSON_U2R), NOTHING).channels[0].sends


@pytest.mark.parametrize("meant", [J.JSON_U2R, J.JSON_R2U])
def test_the_cure_names_the_data_type_that_was_meant(meant: MosaicDataType) -> None:
    with pytest.raises(ConnectionFailed) as caught, naming(meant):
        plan_of(of("x"), NOTHING)
    assert f"--data-type {meant.value}" in caught.value.cure


def test_a_robot_that_announces_itself_knows_better_than_the_caller() -> None:
    with pytest.raises(ConnectionFailed, match="'battery' is json-r2u, not json-u2r"):
        plan_of(of("battery", J.JSON_U2R), ANNOUNCED)
    with pytest.raises(UnknownLabel):
        plan_of(of("x", J.JSON_U2R), ANNOUNCED)


def test_a_caller_who_names_a_data_type_knows_better_than_a_description() -> None:
    assert plan_of(of("battery", J.JSON_U2R), DESCRIBED).channels[0].sends
    assert plan_of(of("base", J.JSON_U2R), DESCRIBED).channels[0].resource == "motion", "it agrees, and knows more"
    assert plan_of(of("link-sender", J.STRING_R2U), DESCRIBED).channels[0].label == "link-sender"


def test_every_camera_and_sound_that_is_announced_gets_a_line() -> None:
    assert media_labels_of(ANNOUNCED, []) == ("front", "ears", "voice")
    assert media_labels_of(NOTHING, []) == ()


def test_of_an_original_robot_all_described_cameras_get_a_line_unless_something_else_was_named() -> None:
    front, other = MediaStreamStore(of("front")), MediaStreamStore(of("other"))
    assert media_labels_of(DESCRIBED, []) == ("front", "ears", "voice")
    assert media_labels_of(DESCRIBED, [other, front]) == ("front", "ears", "voice", "other")
    assert media_labels_of(DESCRIBED, [], [of("base")]) == ()
    assert media_labels_of(DESCRIBED, [front], [of("front")]) == ("front", "ears", "voice")


@pytest.mark.parametrize(
    ("data_type", "kind"),
    [
        (J.MEDIA, MediaStreamStore),
        (J.JSON_BI, BidirectionalStore),
        (J.JSON_U2R, SendableStore),
        (J.JSON_R2U, ReceivableStore),
    ],
)
def test_the_store_is_that_of_the_direction(data_type: MosaicDataType, kind: type) -> None:
    assert type(make_store(of("x"), data_type)) is kind


def test_sound_has_a_store_for_each_way() -> None:
    assert isinstance(sound_store(of("ears"), CATALOGUE), SoundStore)
    assert isinstance(sound_store(of("voice"), CATALOGUE), VoiceStore)
    assert sound_store(of("front"), CATALOGUE) is None
    assert sound_store(of("x"), CATALOGUE) is None


def test_only_a_lease_makes_a_resource_and_without_a_name_it_is_motion() -> None:
    assert [resource_of(one) for one in CATALOGUE.entries[:5]] == [None, "motion", "arm", None, None]


@pytest.mark.parametrize("known", [ANNOUNCED, DESCRIBED, Known(None, is_told=True)])
def test_a_connection_check_that_is_asked_for_by_its_class_has_its_two_channels(known: Known) -> None:
    channels = check_plan_of(of("link", J.STRING_U2R), known).channels
    assert [(one.label, one.sends) for one in channels] == [("link-receiver", True), ("link-sender", False)]


def test_what_the_robot_announces_as_something_else_is_no_connection_check() -> None:
    with pytest.raises(ConnectionFailed, match="'battery' is no connection-check"):
        check_plan_of(of("battery"), ANNOUNCED)


@pytest.mark.parametrize(
    ("known", "label", "patience_s"),
    [
        (Known(Catalogue.of([entry("files", J.JSON_BI, answer_within_s=300.0)])), "files", 305.0),
        (ANNOUNCED, "notes", 30.0),
        (ANNOUNCED, "nothing", 30.0),
        (NOTHING, "notes", 30.0),
    ],
)
def test_an_answer_is_waited_for_a_little_longer_than_its_class_gives_itself(
    known: Known, label: str, patience_s: float
) -> None:
    assert answer_patience_s(label, known) == patience_s
