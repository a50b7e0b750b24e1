"""What nothing would follow is refused when the class is made, with its class, line and cure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import pytest
from pydantic import Field

from mosaic_core import (
    AudioReceivable,
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    DeliveryContract,
    FieldBounds,
    MediaTrackHandler,
    Message,
    Params,
    RequestHandler,
)
from mosaic_core.words.codes import REASONS
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.limits import MotionKind


class Wish(Message):
    speed: float = Field(default=0.0, alias="v")
    angle: float = 0.0


def refusal_of(make: Any) -> str:
    with pytest.raises(MosaicError) as refused:
        make()
    assert refused.value.code in REASONS
    assert refused.value.cure in str(refused.value)
    file, line, told = str(refused.value).split(":", 2)
    assert file == __file__
    first = make.__code__.co_firstlineno
    assert first <= int(line) <= first + 3
    return told.rpartition("<locals>.")[2]


@pytest.mark.parametrize("base", [MediaTrackHandler, AudioReceivable])
@pytest.mark.parametrize("delivery", [Delivery.BULK, DeliveryContract(mode=Delivery.BULK)])
def test_no_picture_and_no_sound_is_bulk(base: type, delivery: Any) -> None:
    with pytest.raises(
        MosaicError, match=r"Film: pictures and sound are never delivered as bulk\. Leave `delivery` out"
    ):
        type("Film", (base,), {"delivery": delivery, "__module__": __name__})


def test_a_field_that_its_messages_do_not_have_is_refused_with_the_nearest() -> None:
    def make() -> None:
        class Arm(DataChannelReceivable[Wish]):
            position_fields: ClassVar[tuple[str, ...]] = ("angel",)

    words = "Arm: position_fields names 'angel', a number that its messages don't have; did you mean 'angle'?"
    assert refusal_of(make) == f"{words} They have: angle, v."


def test_a_field_is_named_as_the_json_names_it() -> None:
    def make() -> None:
        class Base(DataChannelReceivable[Wish]):
            motion_fields: ClassVar[tuple[str, ...]] = ("speed",)

    assert refusal_of(make).startswith("Base: motion_fields names 'speed', a number that its messages don't have. ")


def test_a_field_is_no_velocity_and_position_at_once() -> None:
    def make() -> None:
        class Both(DataChannelReceivable[Wish]):
            motion_fields: ClassVar[tuple[str, ...]] = ("angle",)
            position_fields: ClassVar[tuple[str, ...]] = ("angle",)

    assert refusal_of(make).startswith("Both: 'angle' is in motion_fields and in position_fields. Name it once")


def test_of_messages_without_a_schema_any_field_may_be_named() -> None:
    class Loose(DataChannelReceivable[dict[str, Any]]):
        motion_fields: ClassVar[tuple[str, ...]] = ("whatever.x",)

    assert Loose.motion_fields == ("whatever.x",)


class Joints(Message):
    keyed_by: ClassVar[Mapping[str, str]] = {"positions": "names"}
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"positions": "position"}
    names: list[str]
    positions: list[float]


def declared(base: type, **said: Any) -> str:
    """What is said against a class of this body."""
    with pytest.raises(MosaicError) as refused:
        type("It", (base,), {**said, "__module__": __name__})
    assert refused.value.code == "config.broken_plugin"
    assert refused.value.cure in str(refused.value)
    return str(refused.value).partition("It: ")[2]


class Takes(DataChannelReceivable[Wish]):
    """Takes a wish."""


class Sends(DataChannelSendable[Wish]):
    """Sends a wish."""


class Moves(DataChannelReceivable[Joints]):
    def make_safe(self, cause: str) -> None:
        """Holds."""


class Asks(RequestHandler[Wish, Wish]):
    """Answers a wish."""


AT_MOST = FieldBounds(max=1.0)


@pytest.mark.parametrize(
    ("base", "said", "words"),
    [
        (Takes, {"timeout_s": 0.5}, "timeout_s is set, and after it nothing would happen: make_safe is not written. "),
        (Moves, {"timeout_s": 0}, "timeout_s is 0, and no time-out. Write seconds above 0 and up to 60, or None."),
        (Moves, {"timeout_s": 61.0}, "timeout_s is 61, and no time-out. "),
        (Moves, {"timeout_s": "0.5"}, "timeout_s is '0.5', and no number. Write seconds, such as 0.5."),
        (Takes, {"delivery": "latest"}, "delivery is 'latest', and no way to deliver. Write one of Delivery.RELI"),
        (Takes, {"widget": 3}, "widget is 3, and no name. There are: audio"),
        (Moves, {"resource": "Left arm"}, "the lease of 'Left arm' can't be taken. Write small letters"),
        (Takes, {"widget": "drive-pat"}, "there is no widget 'drive-pat'; did you mean 'drive-pad'? There are: a"),
        (MediaTrackHandler, {"widget": "film"}, "there is no widget 'film'"),
        (
            MediaTrackHandler,
            {"widget": "battery"},
            "the widget 'battery' shows no pictures. Leave `widget` out, or wri",
        ),
        (
            AudioReceivable,
            {"widget": "video"},
            "the widget 'video' shows no sound. Leave `widget` out, or write one of",
        ),
        (Takes, {"widget": "video"}, "the widget 'video' shows no data. Leave `widget` out, or write one of batte"),
        (Sends, {"runs": "sometimes"}, 'runs is \'sometimes\', and no time to run. Write "always" or "watched".'),
        (
            Takes,
            {"runs": "watched"},
            "runs is set, and it has no body that could run: it waits for what operators send",
        ),
        (Takes, {"requires_lease": "yes"}, "requires_lease is 'yes', and no truth value. Write True or False."),
        (Takes, {"takes_observers": 1}, "takes_observers is 1, and no truth value. Write True or False."),
        (Takes, {"is_part": None}, "is_part is None, and no truth value. Write True or False."),
        (
            Takes,
            {"motion_fields": "angle"},
            "motion_fields is 'angle', and no tuple of names. Write the dotted paths a",
        ),
        (Takes, {"position_fields": (1,)}, "position_fields is (1,), and no tuple of names."),
        (Moves, {"item_names": "elbow"}, "item_names is 'elbow', and no tuple of names."),
        (Takes, {"limits": [AT_MOST]}, "limits is [FieldBounds("),
        (Takes, {"resource": None}, 'resource is None, and no name of a lease. Write a name, such as "arm".'),
        (Moves, {"timeout_s": True}, "timeout_s is True, and no number. Write seconds, such as 0.5."),
        (Takes, {"limits": {"angel": AT_MOST}}, "limits names 'angel', a number that its messages don't have; did you"),
        (Takes, {"limits": {"angle": {"max": 1}}}, "the limit of 'angle' is a dict. Write FieldBounds(min=…, max=…)."),
        (Takes, {"limits": {"angle": FieldBounds(min=1.0)}}, "limit of angle: zero must be allowed (min <= 0 <= max)"),
        (
            Takes,
            {"limits": {"angle": FieldBounds(kind="velocity")}, "position_fields": ("angle",)},
            "'angle' is a position, and can't be limited as a velocity. Cure: remove `kind`, or name it in",
        ),
        (
            Takes,
            {"limits": {"angle": FieldBounds(max_rise_per_s=1.0)}, "position_fields": ("angle",)},
            "limit of angle: max_rise_per_s is for a velocity, and this is a position. Cure: write max_rate_per_s",
        ),
        (Moves, {"limits": {"positions": AT_MOST}}, "limits names 'positions', a number that its messages don't have"),
        (
            DataChannelReceivable,
            {"limits": {"positions.*": AT_MOST}},
            "limits names 'positions.*', and it does not say which messages it takes. Name their type, such as",
        ),
        (
            DataChannelReceivable,
            {"motion_fields": ("positions.0",)},
            "motion_fields names 'positions.0', and it does not say which messages it takes. Name their type, such as",
        ),
        (
            Moves,
            {"limits": {"positions.elbo": AT_MOST}, "item_names": ("elbow",)},
            "limits names 'positions.elbo', a number that its messages don't have; did you mean 'positions.elbow'?",
        ),
        (
            Moves,
            {"limits": {"positions.*": FieldBounds(kind="velocity")}},
            "'positions.*' is a position, and can't be limited as a velocity. Cure: remove `kind`, or name it in",
        ),
        (
            Moves,
            {"position_fields": (), "limits": {"positions.*": AT_MOST}},
            "'positions.*' stands in a list, of which only positions can be limited. Cure: give each velocity a field",
        ),
        (
            Takes,
            {"limits": {"angle": FieldBounds()}},
            "the limit of 'angle' bounds nothing. Write FieldBounds(min=…, max",
        ),
        (
            Takes,
            {"item_names": ("elbow",)},
            "item_names is set, and its messages have no list whose numbers are named. S",
        ),
        (Moves, {"item_names": ("elbow", "elbow")}, "item_names has 'elbow' twice. Name each once."),
        (
            Takes,
            {"timeout_s": lambda self: 0.5},
            "timeout_s is a method, and is read, not called. Write seconds, such as",
        ),
        (
            Takes,
            {"widget": lambda self: "battery"},
            "widget is a method, and is read, not called. Write it as a value. ",
        ),
        (
            Takes,
            {"motion_fields": lambda self: ()},
            "motion_fields is a method, and is read, not called. Write the dotte",
        ),
        (
            Takes,
            {"motion_fields": property(lambda self: ())},
            "motion_fields is a property, and is read of the class. ",
        ),
        (
            MediaTrackHandler,
            {"encoding": "h264"},
            "encoding is 'h264', and no way to encode. Write EncodingParams(…), of",
        ),
        (
            MediaTrackHandler,
            {"packet_codec": "h265"},
            'packet_codec is \'h265\', and no codec. Write "h264", "vp8" or N',
        ),
        (Asks, {"at_once": 1.5}, "at_once is 1.5, and no number of requests. Write 1 or more."),
        (
            Asks,
            {"answer_within_s": math.inf},
            "answer_within_s is inf, and no number of seconds. Write seconds above 0,",
        ),
        (Moves, {"motion_fields": ("positions.a",)}, "motion_fields names 'positions.a' in a list, and only positions"),
    ],
)
def test_what_a_class_says_of_its_safety_and_nothing_could_follow_is_refused(
    base: type, said: dict[str, Any], words: str
) -> None:
    assert declared(base, **said).startswith(words)


@pytest.mark.parametrize(
    ("base", "said"),
    [
        (Moves, {"timeout_s": 60, "resource": "left_arm", "requires_lease": True}),
        (Takes, {"widget": "drive-pad"}),
        (Takes, {"limits": property(lambda self: {"angle": AT_MOST}), "widget": property(lambda self: None)}),
        (Takes, {"widget": "gps-position"}),
        (Takes, {"widget": "acme-gripper/Grip"}),
        (Takes, {"widget": None}),
        (Takes, {"limits": {"angle": FieldBounds(min=-1.0, max=1.0, max_rise_per_s=2.0)}}),
        (Moves, {"limits": {"positions.*": FieldBounds(min=1.0, max_rate_per_s=1.0), "positions.elbow": AT_MOST}}),
        (Moves, {"limits": {"positions.elbow": AT_MOST}, "item_names": ("elbow", "wrist")}),
        (DataChannelJsonReceivable, {"limits": {"whatever.x": AT_MOST}}),
    ],
)
def test_what_can_be_followed_is_taken(base: type, said: dict[str, Any]) -> None:
    assert issubclass(type("It", (base,), {**said, "__module__": __name__}), base)


def test_the_safety_of_a_class_is_told_with_its_line() -> None:
    def make() -> None:
        class Silent(DataChannelReceivable[Wish]):
            timeout_s = 0.5

    assert refusal_of(make).endswith("make_safe is not written. Write make_safe(self, cause), or remove timeout_s.")


@pytest.mark.parametrize(
    ("keyed_by", "words"),
    [
        ({"position": "names"}, "names 'position', which is no list of numbers. It has: positions."),
        ({"positions": "name"}, "names 'name', which is no list of texts. It has: names."),
    ],
)
def test_a_list_that_nothing_names_is_refused(keyed_by: dict[str, str], words: str) -> None:
    model = type("Odd", (Joints,), {"keyed_by": keyed_by, "__module__": __name__})

    def make() -> None:
        class Arm(DataChannelReceivable[model]): ...  # type: ignore[valid-type]

    assert refusal_of(make) == f"Arm: keyed_by of Odd {words}"


class Inner(Message):
    x: float = 0.0


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            {"motion_kinds": {"sped": "velocity"}},
            "motion_kinds names 'sped', and It has no field 'sped'; did you mean 'sp",
        ),
        (
            {"motion_kinds": {"inner.y": "velocity"}},
            "motion_kinds names 'inner.y', and Inner has no field 'y'; did you",
        ),
        (
            {"motion_kinds": {"speed": "speed"}},
            "motion_kinds says that 'speed' is a 'speed'. Write one of: velocity, pos",
        ),
        (
            {"motion_kinds": ("speed",)},
            "motion_kinds is ('speed',), and no mapping. Write motion_kinds: ClassVar[Mapping",
        ),
        (
            {"schemaid": "acme/It@1"},
            "it has 'schemaid', which nothing reads; did you mean 'schema_id'? Write schema_id,",
        ),
    ],
)
def test_what_a_message_says_of_itself_is_read(said: dict[str, Any], words: str) -> None:
    annotations = {"speed": float, "inner": Inner | None, **dict.fromkeys(said, ClassVar[Any])}
    body = {"speed": 0.0, "inner": None, **said, "__annotations__": annotations, "__module__": __name__}
    with pytest.raises(MosaicError) as refused:
        type("It", (Message,), body)
    assert str(refused.value).partition("It: ")[2].startswith(words.partition("; did you")[0])


def test_motions_of_nested_fields_and_aliases_are_taken() -> None:
    class Fine(Message):
        motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"inner.x": "velocity", "v": "velocity"}
        own_word: ClassVar[str] = "free"
        inner: Inner | None = None
        speed: float = Field(default=0.0, alias="v")

    assert Fine().speed == 0.0


def test_params_that_ignore_a_misspelt_key_are_refused() -> None:
    with pytest.raises(MosaicError, match='its model_config has extra="ignore", with which a misspelt key is ignored'):
        type("It", (Params,), {"model_config": {"extra": "ignore"}, "__module__": __name__})
