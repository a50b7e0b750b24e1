"""Names in the body of a class that look like the contract's, and that nothing reads, are told with the nearest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from mosaic_core import (
    AudioReceivable,
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    Handler,
    MediaTrackHandler,
    Message,
    NoParams,
    RequestHandler,
)
from mosaic_core.contract.declared.class_names import BODIES, VALUES
from mosaic_core.contract.host import HandlerHost
from mosaic_core.words.errors import MosaicError


class Wish(Message):
    speed: float = 0.0


class Tells(DataChannelSendable[Wish]):
    """Tells a wish."""


class Answers(RequestHandler[Wish, Wish]):
    """Answers a wish."""


class Makes(DataChannelConfigurer[NoParams]):
    """Makes nothing yet."""


def body(self: Any) -> None:
    """Some method."""


def made(base: Any, name: str, value: object) -> type:
    namespace = {name: value, "__module__": __name__}
    return type("It", (base,), namespace)


def told(base: Any, name: str, value: object) -> str:
    with pytest.raises(MosaicError) as refused:
        made(base, name, value)
    assert refused.value.code == "config.broken_plugin"
    place, _, rest = str(refused.value).partition(": It: ")
    assert place.startswith(f"{__file__}:")
    assert rest.endswith(str(refused.value.cure))
    return rest


@pytest.mark.parametrize(
    ("base", "name", "owner"),
    [
        (DataChannelBidirectional, "messages", "DataChannelSendable"),
        (DataChannelSendable, "handle_data", "DataChannelReceivable"),
        (DataChannelSendable, "make_safe", "DataChannelReceivable"),
        (DataChannelSendable, "reported_position", "DataChannelReceivable"),
        (MediaTrackHandler, "peer_left", "DataChannelReceivable"),
        (DataChannelReceivable, "frames", "MediaTrackHandler"),
        (MediaTrackHandler, "handle_sound", "AudioReceivable"),
        (Handler, "messages", "DataChannelSendable"),
        (Makes, "messages", "DataChannelSendable"),
    ],
)
def test_every_body_has_its_base(base: Any, name: str, owner: str) -> None:
    cure = f"Derive it from {owner}, or give the method another name."
    assert told(base, name, body) == f"nobody calls its {name}(). {cure}"


@pytest.mark.parametrize(
    ("base", "name", "meant", "owner"),
    [
        (MediaTrackHandler, "messages", "frames", "DataChannelSendable"),
        (MediaTrackHandler, "sounds", "frames", "AudioTrackHandler"),
        (DataChannelSendable, "frames", "messages", "MediaTrackHandler"),
        (AudioReceivable, "handle_data", "handle_sound", "DataChannelReceivable"),
    ],
)
def test_a_body_that_its_base_calls_otherwise_is_told_by_the_name_it_has_there(
    base: Any, name: str, meant: str, owner: str
) -> None:
    cure = f"Write {meant}(), or derive it from {owner}, or give the method another name."
    assert told(base, name, body) == f"nobody calls its {name}(). {cure}"


@pytest.mark.parametrize(
    ("base", "name", "value", "owner"),
    [
        (Tells, "requires_lease", True, "DataChannelReceivable"),
        (Tells, "timeout_s", 0.5, "DataChannelReceivable"),
        (Tells, "resource", "arm", "DataChannelReceivable"),
        (MediaTrackHandler, "takes_observers", True, "DataChannelReceivable"),
        (MediaTrackHandler, "motion_fields", ("x",), "DataChannelReceivable"),
        (AudioReceivable, "limits", {}, "DataChannelReceivable"),
        (DataChannelJsonReceivable, "sends", Wish, "DataChannelBidirectional"),
        (DataChannelJsonReceivable, "at_once", 3, "RequestHandler"),
        (Tells, "connector_type", "tells", "Configurer"),
        (Makes, "timeout_s", 0.5, "DataChannelReceivable"),
        (Makes, "widget", "battery", "Handler"),
    ],
)
def test_every_value_has_its_base(base: Any, name: str, value: object, owner: str) -> None:
    assert told(base, name, value) == f"nobody reads its {name}. Derive it from {owner}, or give it another name."


@pytest.mark.parametrize(
    ("base", "name", "value", "meant"),
    [
        (DataChannelJsonReceivable, "timout_s", 0.5, "timeout_s"),
        (DataChannelJsonReceivable, "timeout_ms", 500, "timeout_s"),
        (DataChannelJsonReceivable, "require_lease", True, "requires_lease"),
        (DataChannelJsonReceivable, "requires_leas", True, "requires_lease"),
        (DataChannelJsonReceivable, "takes_observer", True, "takes_observers"),
        (DataChannelJsonReceivable, "motion_field", ("x",), "motion_fields"),
        (DataChannelJsonReceivable, "limit", {}, "limits"),
        (DataChannelJsonReceivable, "widgets", "json-sender", "widget"),
        (DataChannelJsonReceivable, "wigdet", "json-sender", "widget"),
        (DataChannelJsonReceivable, "handel_data", body, "handle_data"),
        (DataChannelJsonReceivable, "make_save", body, "make_safe"),
        (DataChannelJsonReceivable, "reports_position", body, "reported_position"),
        (Tells, "run", "watched", "runs"),
        (Tells, "mesages", body, "messages"),
        (Tells, "message", staticmethod(body), "messages"),
        (MediaTrackHandler, "frame", body, "frames"),
        (MediaTrackHandler, "delivry", "latest", "delivery"),
        (DataChannelBidirectional, "send_s", Wish, "sends"),
        (Answers, "anwser", body, "answer"),
        (Answers, "answer_within", 3.0, "answer_within_s"),
        (DataChannelJsonReceivable, "Widget", "json-sender", "widget"),
        (DataChannelJsonReceivable, "motionFields", ("x",), "motion_fields"),
        (DataChannelJsonReceivable, "MotionFields", ("x",), "motion_fields"),
        (DataChannelJsonReceivable, "TIMEOUT_S", 0.5, "timeout_s"),
        (DataChannelJsonReceivable, "REQUIRES_LEASE", True, "requires_lease"),
        (DataChannelJsonReceivable, "MOTION_FIELDS", ("x",), "motion_fields"),
        (DataChannelJsonReceivable, "needs_lease", True, "requires_lease"),
        (DataChannelJsonReceivable, "handleData", body, "handle_data"),
        (Makes, "PARAMS_MODEL", NoParams(), "params_model"),
        (Makes, "exmple", {}, "example"),
        (Makes, "safty_model", Wish, "safety_model"),
        (Makes, "trails", {}, "trial"),
        (Makes, "conector_type", "it", "connector_type"),
        (Makes, "configre", body, "configure"),
        (Makes, "param_model", NoParams, "params_model"),
    ],
)
def test_a_name_that_is_almost_one_of_the_contract_is_told(base: Any, name: str, value: object, meant: str) -> None:
    assert told(base, name, value) == (
        f"it has '{name}', which nothing reads; did you mean '{meant}'? "
        f"Write {meant}, or begin a name of your own with _."
    )


@pytest.mark.parametrize("word", sorted({*BODIES, *VALUES}))
def test_every_word_is_one_of_its_base(word: str) -> None:
    import mosaic_core

    base = getattr(mosaic_core, {**VALUES, **BODIES}[word], None) or mosaic_core.DataChannelConfigurer
    assert hasattr(base, word)


@pytest.mark.parametrize(
    ("base", "name", "value"),
    [
        (Tells, "message", "hello"),
        (Tells, "run", body),
        (Tells, "timeout_ms", 3),
        (DataChannelJsonReceivable, "_timout_s", 0.5),
        (DataChannelJsonReceivable, "limit", body),
        (DataChannelJsonReceivable, "source", "/dev/ttyACM0"),
        (MediaTrackHandler, "frame", None),
        (MediaTrackHandler, "decoding", "h264"),
        (Tells, "encoding", "utf-8"),
        (Tells, "configure", body),
        (Tells, "Widget", Wish),
        (Tells, "needs_lease", True),
        (DataChannelJsonReceivable, "LIMITS", (0, 1)),
        (DataChannelJsonReceivable, "TIMEOUT_MS", 500),
        (DataChannelJsonReceivable, "RETRY_TIMEOUT_S", 0.5),
        (Makes, "serial", "/dev/ttyACM0"),
        (Makes, "agreed", body),
    ],
)
def test_names_of_ones_own_are_free(base: Any, name: str, value: object) -> None:
    assert made(base, name, value).__name__ == "It"


def test_the_singular_is_free_beside_the_plural() -> None:
    class Talks(DataChannelSendable[Wish]):
        def message(self) -> Wish:
            return Wish()

        def messages(self) -> Iterator[Wish]:
            yield self.message()

    assert [*Talks("it").messages()] == [Wish()]


def test_the_api_version_belongs_to_the_module() -> None:
    for base in (Tells, Makes):
        cure = "Write it above the class, at the left margin."
        assert told(base, "MOSAIC_API_VERSION", 1) == (
            f"MOSAIC_API_VERSION stands in the class, and is read from its module. {cure}"
        )


def test_the_line_is_that_of_the_class() -> None:
    def make() -> None:
        class Echo(DataChannelReceivable[Wish]):
            requires_leas: ClassVar[bool] = True

    with pytest.raises(MosaicError) as refused:
        make()
    line = make.__code__.co_firstlineno + 1
    assert str(refused.value).startswith(f"{__file__}:{line}: {make.__qualname__}.<locals>.Echo: ")


def test_a_mixin_may_bring_a_body_to_its_base() -> None:
    class Talks:
        def messages(self) -> Iterator[Wish]:
            yield Wish()

    class Both(Talks, DataChannelSendable[Wish]):
        def messages(self) -> Iterator[Wish]:
            yield from super().messages()

    assert [*Both("b").messages()] == [Wish()]


@pytest.mark.parametrize("base", [DataChannelSendable, DataChannelSendable[Message], DataChannelReceivable[Message]])
def test_a_base_itself_is_no_handler(base: Any) -> None:
    with pytest.raises(MosaicError) as caught:
        base("it")
    line = caught.traceback[0].lineno + 1
    name = base.__name__.partition("[")[0]
    assert caught.value.message.startswith(f"{__file__}:{line}: {name} itself does not know what it carries. Derive a")


@pytest.mark.parametrize(
    ("base", "name", "value", "cure"),
    [
        (Tells, "label", "front", "Leave it out: the configurer gives it to __init__."),
        (Tells, "data_type", "json", "Leave it out: it follows from the base and the type in its brackets."),
        (Tells, "direction", "u2r", "Leave it out: it follows from the base and the type in its brackets."),
        (MediaTrackHandler, "kind", "video", "Leave it out: it follows from the base and the type in its brackets."),
        (
            DataChannelJsonReceivable,
            "lease",
            "arm",
            'Write requires_lease = True, and resource = "…" for a lease of its own.',
        ),
        (
            DataChannelJsonReceivable,
            "safety",
            {"timeout_s": 1.0},
            "Write its parts one by one: timeout_s, requires_lease, resource, limits.",
        ),
        (
            DataChannelJsonReceivable,
            "on_timeout",
            "zero",
            "Write it in `safety:` of the robot's file, or as a default of the configurer's safety_model.",
        ),
        (Makes, "params", NoParams, "Name their class in the brackets of the base: DataChannelConfigurer[MyParams]."),
        (Makes, "Params", NoParams, "Write that class above, and name it in the brackets of the base: DataChannelC"),
        (Makes, "label", "front", "Leave it out: the robot's file says it."),
    ],
)
def test_what_is_said_elsewhere_is_told_with_its_place(base: Any, name: str, value: object, cure: str) -> None:
    assert told(base, name, value).startswith(f"nobody reads the {name} of its class. {cure}")


@pytest.mark.parametrize(
    ("base", "name", "value"),
    [(DataChannelJsonReceivable, "on_timeout", body), (Tells, "params", NoParams), (Makes, "kind", "arm")],
)
def test_what_is_no_value_or_of_another_base_is_free(base: Any, name: str, value: object) -> None:
    assert made(base, name, value).__name__ == "It"


@pytest.mark.parametrize("said", [0.5, "0.5"])
def test_a_value_behind_a_colon_is_told(said: object) -> None:
    assert told(Loose, "__annotations__", {"timeout_s": said}) == (
        "timeout_s is annotated with 0.5, and not set. Write timeout_s = 0.5."
    )
    assert made(Loose, "__annotations__", {"timeout_s": "float | None", "source": 3}).__name__ == "It"


class Loose(DataChannelJsonReceivable):
    """Takes anything."""


def test_a_handler_has_one_channel_or_track() -> None:
    for bases in ((Tells, Loose), (MediaTrackHandler, Tells)):
        with pytest.raises(MosaicError, match=r"and has one channel or track\. Write two handlers"):
            type("It", bases, {"__module__": __name__})


def test_the_model_of_params_is_the_one_in_the_brackets() -> None:
    class Own(NoParams):
        """Of another configurer."""

    with pytest.raises(MosaicError, match=r"its params_model is Own, and its base has \[NoParams\]. Name the right"):

        class Two(DataChannelConfigurer[NoParams]):
            params_model = Own


@pytest.mark.parametrize("name", ["send", "pause", "every", "_send"])
@pytest.mark.parametrize("value", [0.5, lambda self: None])
def test_what_the_framework_calls_itself_is_not_written_anew(name: str, value: object) -> None:
    with pytest.raises(MosaicError, match=rf": {name} is the framework's own\. Give yours another name"):
        type("Own", (Tells,), {name: value})


@pytest.mark.parametrize("value", [0.5, lambda self: None])
def test_a_bind_that_takes_no_host_is_refused(value: object) -> None:
    with pytest.raises(MosaicError, match=r"bind is the framework's own, .* write def bind\(self, host\)"):
        type("Own", (Tells,), {"bind": value})


def test_a_receiver_may_send_in_its_own_way_and_a_handler_may_add_to_bind() -> None:
    class Sends(DataChannelReceivable[Wish]):
        def send(self, speed: float) -> None:
            """To its motor."""

    class Adds(Tells):
        def bind(self, host: HandlerHost) -> None:
            super().bind(host)


@pytest.mark.parametrize(("name", "meant"), [("Widget", "widget"), ("TIMEOUT_S", "timeout_s"), ("Runs", "runs")])
def test_a_name_in_capitals_is_told_with_the_one_that_is_read(name: str, meant: str) -> None:
    said = told(DataChannelReceivable, name, "gauge")
    assert said.startswith(f"it has '{name}', which nothing reads; did you mean '{meant}'?")


def test_a_class_inside_and_a_constant_that_is_read_keep_their_capitals() -> None:
    made(DataChannelReceivable, "Widget", Wish)
    assert made(DataChannelReceivable, "LIMITS", {}).LIMITS == {}  # type: ignore[attr-defined]
