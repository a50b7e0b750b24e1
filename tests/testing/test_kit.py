"""The kit: waiting passes fake time, validation and time-outs are the robot's."""

from __future__ import annotations

import asyncio
import json
import math
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import Field

from mosaic_core import (
    Configurer,
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    MediaTrackConfigurer,
    MediaTrackHandler,
    Message,
    MosaicError,
    NoParams,
    Params,
    Refused,
    Request,
    RequestHandler,
    Sender,
    Shared,
)
from mosaic_core.testing import (
    ANOTHER_OPERATOR,
    OPERATOR,
    FakeClock,
    From,
    Leaves,
    LinkProfile,
    MadeSafe,
    MemoryNetwork,
    RefusedMessage,
    Silence,
    SlowedTo,
    ask,
    build,
    collect,
    connector,
    fake_host,
    feed,
    joined,
    missing_to_gold,
    take_frames,
    take_sounds,
    until,
)
from mosaic_core.testing.distributions import forget_modules_of, write_distribution
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.errors import ConfigError


class TickParams(Params):
    period_s: float = Field(default=1.0, gt=0)


class Tick(Message):
    at_s: float


class Ticker(DataChannelSendable[Tick]):
    def __init__(self, label: str, period_s: float) -> None:
        super().__init__(label)
        self.period_s = period_s
        self.is_open = False
        self.opened = 0

    def messages(self) -> Iterator[Tick]:
        self.is_open, self.opened = True, self.opened + 1
        try:
            for _ in self.every(self.period_s):
                yield Tick(at_s=self.monotonic_s())
        finally:
            self.is_open = False


class TickerConfigurer(DataChannelConfigurer[TickParams]):
    def configure(self) -> Ticker:
        return Ticker(self.label, self.params.period_s)


class AsyncTicker(Ticker):
    async def messages(self) -> AsyncIterator[Tick]:  # type: ignore[override]
        async for _ in self.every(self.period_s):
            yield Tick(at_s=self.monotonic_s())


class Speed(Message):
    mps: float


class Crane(DataChannelReceivable[Speed]):
    timeout_s = 0.5

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.speed_mps = 0.0
        self.left: list[Sender] = []

    def handle_data(self, data: Speed, sender: Sender) -> None:
        if data.mps > 10:
            raise Refused("safety.stale", "too fast")
        if data.mps < 0:
            self.pause(2.0)
        self.speed_mps = data.mps

    def make_safe(self, cause: str) -> None:
        self.speed_mps = 0.0

    def peer_left(self, sender: Sender) -> None:
        self.left.append(sender)


class CraneConfigurer(DataChannelConfigurer[TickParams]):
    def configure(self) -> Crane:
        return Crane(self.label)


def test_messages_are_collected_without_waiting_for_real_time(fake_clock: FakeClock) -> None:
    start_s = fake_clock.now_s
    ticker = build(TickerConfigurer, params={"period_s": 600}, clock=fake_clock)

    assert [tick.at_s - start_s for tick in collect(ticker, 3)] == [0, 600, 1200]
    assert fake_host(ticker).sent_values() == [{"at_s": start_s + 600 * step} for step in range(3)]


def test_the_body_is_closed_and_can_be_started_again() -> None:
    ticker = build(TickerConfigurer)
    collect(ticker, 1)
    assert not ticker.is_open
    collect(ticker, 2)
    assert ticker.opened == 2


def test_async_bodies_are_collected_too() -> None:
    ticker = AsyncTicker("ticks", 0.25)
    assert [tick.at_s for tick in collect(ticker, 3)] == [1000.0, 1000.25, 1000.5]


def test_a_body_that_yields_too_little_is_named() -> None:
    with pytest.raises(AssertionError, match=r"under_test: 11 of 20 messages within 10\.5 s of fake time"):
        collect(build(TickerConfigurer), 20, within_s=10.5)


def test_a_body_that_ends_gives_all_it_has() -> None:
    class Countdown(DataChannelSendable[str]):
        def messages(self) -> Iterator[str]:
            yield from ("2", "1")

    assert collect(Countdown("count")) == ["2", "1"]
    with pytest.raises(AssertionError, match="2 of 3"):
        collect(Countdown("count"), 3)


def test_a_message_that_is_no_json_fails_where_it_is_collected() -> None:
    class Broken(DataChannelSendable[dict[str, Any]]):
        def messages(self) -> Iterator[dict[str, Any]]:
            yield {"x": object()}

    with pytest.raises(MosaicError, match="sends 'x' as object, which JSON does not know"):
        collect(Broken("broken"), 1)


class Level(Message):
    percent: float


class Doubtful(DataChannelSendable[Level]):
    def messages(self) -> Iterator[Level]:
        for percent in (1.0, math.nan, 3.0):
            yield Level(percent=percent)


class DoubtfulTask(DataChannelSendable[Level]):
    async def messages(self) -> AsyncIterator[Level]:
        for percent in (1.0, math.nan, 3.0):
            yield Level(percent=percent)


@pytest.mark.parametrize("kind", [Doubtful, DoubtfulTask])
@pytest.mark.parametrize("count", [None, 2, 3])
def test_a_message_with_nan_between_good_ones_fails_the_test_with_its_field_and_line(kind: Any, count: Any) -> None:
    doubtful = kind("gauge")
    with pytest.raises(AssertionError) as caught:
        collect(doubtful, count)
    place = f"{__file__}:{kind.messages.__code__.co_firstlineno + 2}"
    why = "which is no finite number and not declared as `float | None`"
    told = f"gauge: 1 of 3 messages would be refused on a robot: {kind.__name__} ({place}) sends 'percent', {why}"
    assert str(caught.value) == told
    assert fake_host(doubtful).sent_values() == [{"percent": 1.0}, {"percent": 3.0}]
    assert fake_host(doubtful).losses == {"refused": 1}
    assert collect(doubtful, 1) == [Level(percent=1.0)], "it came before"


def test_params_are_checked_as_in_the_file() -> None:
    with pytest.raises(ConfigError) as caught:
        build(TickerConfigurer, params={"period_s": 0, "perod_s": 1})
    assert [problem.path for problem in caught.value.problems] == ["params.period_s", "params.perod_s"]
    assert "did you mean 'period_s'?" in str(caught.value)


def test_silence_makes_safe_once_and_at_its_exact_time() -> None:
    motor = build(CraneConfigurer)
    fed = feed(motor, [{"mps": 1}, Silence(0.4), {"mps": 2}, Silence(10), {"mps": 3}, Silence(0.1)])

    assert fed.made_safe == [MadeSafe(0.9, "safety.timeout")]
    assert [message.mps for message in fed.accepted] == [1, 2, 3]
    assert motor.speed_mps == 3


def test_the_timeout_of_the_file_overrides_the_handlers() -> None:
    fed = feed(build(CraneConfigurer, safety={"timeout_s": 2}), [{"mps": 1}, Silence(5)])
    assert fed.made_safe == [MadeSafe(2.0, "safety.timeout")]


def test_the_safe_action_runs_while_the_handler_hangs_and_again_after_it() -> None:
    motor = build(CraneConfigurer)
    fed = feed(motor, [{"mps": -1}])
    assert fed.made_safe == [MadeSafe(0.5, "safety.timeout"), MadeSafe(2.0, "safety.timeout")]
    assert motor.speed_mps == 0


def test_what_does_not_validate_is_refused_before_the_handler() -> None:
    fed = feed(build(CraneConfigurer), ['{"mps": NaN}', b"\xff", "{", {"speed": 1}, {"mps": 99}])
    codes = ["safety.not_finite", "channel.invalid", "channel.invalid", "channel.invalid", "safety.stale"]
    assert [refused.code for refused in fed.refused] == codes
    assert fed.refused[-1] == RefusedMessage(0.0, "safety.stale", "too fast")
    assert fed.accepted == []


def test_only_the_commanding_operator_stops_the_motor_by_leaving() -> None:
    motor = build(CraneConfigurer)
    fed = feed(motor, [From(OPERATOR, {"mps": 1}), Leaves(ANOTHER_OPERATOR), Silence(0.1), Leaves(OPERATOR)])
    assert fed.made_safe == [MadeSafe(0.1, "safety.peer_left")]
    assert motor.left == [ANOTHER_OPERATOR, OPERATOR]


def test_async_receivers_are_fed_and_may_refuse() -> None:
    class Echo(DataChannelBidirectional[dict[str, Any]]):
        async def handle_data(self, data: dict[str, Any], sender: Sender) -> None:
            if not data:
                raise Refused("channel.invalid")
            self.send_json(data, to=sender)

    echo = Echo("echo")
    fed = feed(echo, [{"a": 1}, {}, {"b": 2}])
    assert fed.accepted == [{"a": 1}, {"b": 2}]
    assert len(fed.refused) == 1
    assert [(one.to, json.loads(one.payload)) for one in fake_host(echo).sent] == [
        ("peer-1", {"a": 1}),
        ("peer-1", {"b": 2}),
    ]


def test_an_error_of_the_handler_reaches_the_test() -> None:
    class Faulty(DataChannelReceivable[str]):
        def handle_data(self, data: str) -> None:
            raise RuntimeError(data)

    with pytest.raises(RuntimeError, match="boom"):
        feed(Faulty("faulty"), ["boom"])


def test_frames_are_taken() -> None:
    class Pattern(MediaTrackHandler):
        def frames(self) -> Iterator[Any]:
            for index in self.every(0.1):
                yield np.full((4, 6), index, np.uint8)

    class PatternConfigurer(MediaTrackConfigurer[Params]):
        def configure(self) -> Pattern:
            return Pattern(self.label)

    pattern = build(PatternConfigurer)
    first, second = take_frames(pattern, 2)
    assert isinstance(second, np.ndarray)
    assert (second == 1).all()
    assert fake_host(pattern).pictures == [first, second]


def test_a_configurer_may_make_several_handlers_on_one_clock() -> None:
    class Pair(Configurer[TickParams]):
        def configure(self) -> list[Ticker]:
            return [Ticker(f"{self.label}-a", 1), Ticker(f"{self.label}-b", 1)]

    first, second = build(Pair, label="pair")
    assert (first.label, second.label) == ("pair-a", "pair-b")
    assert fake_host(first).clock is fake_host(second).clock


def test_shared_and_safety_reach_the_configurer() -> None:
    seen: list[object] = []

    class Limits(SafetyConfig):
        max_mps: float = 1.0

    class Looking(DataChannelConfigurer[TickParams]):
        safety_model = Limits

        def configure(self) -> Crane:
            seen.extend((self.shared, self.safety))
            return Crane(self.label)

    shared = Shared()
    build(Looking, safety={"max_mps": 2}, shared=shared)
    assert seen == [shared, Limits(max_mps=2)]


def test_a_throw_away_distribution_is_installed_for_one_test(install_distribution: InstallDistribution) -> None:
    from importlib.metadata import entry_points, version

    install_distribution(
        "acme-lamp",
        version="2.3",
        modules={"acme_lamp": "ANSWER = 42"},
        entry_points={"acme": {"lamp": "acme_lamp:ANSWER"}},
    )
    (point,) = entry_points(group="acme")
    assert point.load() == 42
    assert version("acme-lamp") == "2.3"


def test_the_pytest_plugin_loads_nothing_heavy() -> None:
    code = (
        "import sys, mosaic_core.testing.pytest_plugin;"
        "print([name for name in ('numpy', 'av', 'cv2', 'aiortc', 'typer', 'rich', 'yaml') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_a_throw_away_distribution_leaves_no_module_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor a package without an `__init__.py`, which no file of its own gives away."""
    write_distribution(tmp_path, "acme-gone", modules={"acme_gone_space.inner": "", "acme_gone": ""})
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("acme_gone_space.inner", "acme_gone"):
        import_module(name)
    forget_modules_of(tmp_path)
    assert [name for name in sys.modules if name.startswith("acme_gone")] == []


def test_a_package_that_lies_elsewhere_too_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for site in ("ours", "theirs"):
        write_distribution(tmp_path / site, f"acme-{site}", modules={f"acme_both.{site}": ""})
        monkeypatch.syspath_prepend(str(tmp_path / site))
        import_module(f"acme_both.{site}")
    forget_modules_of(tmp_path / "theirs")
    assert {name for name in sys.modules if name.startswith("acme_both")} == {"acme_both", "acme_both.ours"}
    forget_modules_of(tmp_path)


class NothingConfigurer(Configurer[Params]):
    def configure(self) -> None:  # type: ignore[override]
        Crane(self.label)


class Answering(RequestHandler[Level, Level]):
    def answer(self, question: Level, request: Request) -> Level:
        return question


class BothConfigurer(Configurer[Params]):
    def configure(self) -> list[Any]:
        return [Answering("answers"), Doubtful("gauge")]


@pytest.mark.parametrize(
    ("function", "handler", "said"),
    [
        (
            collect,
            Answering("it"),
            "tests a handler that has `messages`, and Answering has none: it is tested by `ask`",
        ),
        (ask, Doubtful("it"), "tests a handler that has `answer`, and Doubtful has none: it is tested by `collect`"),
        (take_sounds, MediaTrackHandler("it"), "has none: it is tested by `take_frames`"),
        (feed, MediaTrackHandler("it"), "has none: it is tested by `take_frames`"),
        (collect, Doubtful, "`collect` tests a handler, not a class: write `build(…)` of its configurer"),
        (collect, None, "`collect` tests a handler that has `messages`, and NoneType has none"),
    ],
)
def test_whoever_gives_another_kind_of_handler_is_told_what_tests_it(function: Any, handler: Any, said: str) -> None:
    with pytest.raises(TypeError) as caught:
        function(handler, [])
    assert str(caught.value).endswith(said)


def test_one_of_several_handlers_is_tested() -> None:
    several = r"^`collect` tests one handler, and `configure\(\)` made several \(Answering, Doubtful\)"
    with pytest.raises(TypeError, match=rf"{several}: write `build\(…\)\[1\]`$"):
        collect(build(BothConfigurer), 1)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"made several \(Answering, Doubtful\), and none of them has `frames`$"):
        take_frames(build(BothConfigurer), 1)  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [Doubtful, BothConfigurer("it", Params())])
def test_what_is_built_is_a_configurer(given: Any) -> None:
    with pytest.raises(TypeError, match=r"takes the class of a configurer, .* not (Doubtful|an instance of Both)"):
        build(given)


@pytest.mark.parametrize("script", [{"percent": 1}, Level(percent=1), '{"percent": 1}'])
def test_a_script_is_a_list_also_of_one_message(script: Any) -> None:
    with pytest.raises(TypeError, match=r"not a (dict|Level|str): write `\[…\]` around it"):
        feed(Answering("it"), script)


async def test_two_connectors_of_one_label_are_told() -> None:
    class Tick(DataChannelSendable[str]):
        def messages(self) -> Iterator[str]:
            yield "tick"

    class TickConfigurer(DataChannelConfigurer[NoParams]):
        def configure(self) -> Tick:
            return Tick(self.label)

    with pytest.raises(ConfigError, match="two connectors have the label 'under_test'"):
        async with joined(connector(TickConfigurer), connector(TickConfigurer)):
            """Never."""


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Silence("1"), "Silence takes a number, not '1'"),
        (lambda: Silence(-1), "Silence lasts 0 s or longer, not -1"),
        (lambda: Silence(float("nan")), "Silence lasts 0 s or longer, not nan"),
        (lambda: SlowedTo(20), "SlowedTo takes a share from 0 to 1, not 20"),
        (lambda: feed(Answering("it"), [Silence]), r"a step is made with brackets: write `Silence\(…\)`"),
        (lambda: feed(Answering("it"), Silence), r"not a class: write `\[Silence\(…\)\]`"),
        (lambda: feed(Answering("it"), Silence(1)), r"not a Silence: write `\[…\]` around it"),
        (lambda: collect(Doubtful("it"), 0), "take 1 of the messages or more, not 0; all of them without a count"),
        (lambda: FakeClock().advance(-1), "a clock advances by 0 s or more, not -1"),
        (lambda: LinkProfile("bad", loss=3), "loss is a share of the packets, from 0 to 1, not 3"),
        (lambda: LinkProfile("bad", delay_ms=-3), "delay_ms is 0 or more, not -3"),
        (lambda: LinkProfile("bad", rate_mbps=0), "rate_mbps is more than 0, or None for no bottleneck, not 0"),
        (lambda: MemoryNetwork("wifi-wals"), "no network has the profile 'wifi-wals': did you mean 'wifi-walls'"),
        (lambda: connector(Doubtful), "`connector` takes the class of a configurer, .* and not Doubtful"),
        (lambda: connector(BothConfigurer, label="a b"), r"label"),
        (lambda: build(BothConfigurer, label="a b"), r"label"),
        (lambda: build(BothConfigurer, delivery="reliabel"), r"delivery.*reliable"),
        (lambda: build(CraneConfigurer, clock=FakeClock), r"not the class FakeClock: write `clock=FakeClock\(\)`"),
        (lambda: build(CraneConfigurer, clock=3), r"`clock` is a FakeClock, and not 3: write `clock=FakeClock\(\)`"),
        (lambda: build(CraneConfigurer, shared=Shared), r"not the class Shared: write `shared=Shared\(\)`"),
        (lambda: build(CraneConfigurer, params=["a"]), r"`build` takes params as the YAML file has it, .* not \['a'\]"),
        (
            lambda: connector(CraneConfigurer, safety="a"),
            r"`connector` takes safety as the YAML file has it, .* not 'a'",
        ),
        (lambda: feed(Crane("it"), [{"mps": 1}, 1.0]), r"1\.0 is neither: write `Silence\(1\.0\)` for a pause"),
        (lambda: feed(Crane("it"), [None]), "a script is made of messages and steps, and None is neither$"),
        (lambda: From("alice", {"mps": 1}), "From takes a Sender, such as OPERATOR, not 'alice'"),
        (lambda: Leaves("alice"), "Leaves takes a Sender, such as OPERATOR, not 'alice'"),
        (lambda: collect(Doubtful("it"), "3"), "take a whole number of the messages, not '3'"),
        (lambda: collect(Doubtful("it"), 1, within_s="3"), "within_s is a number of seconds, not '3'"),
        (lambda: fake_host(Crane), r"`fake_host` takes a handler, not a class: write `build\(…\)` of its configurer"),
        (lambda: fake_host([Crane("it")]), r"not a list: write `build\(…\)\[0\]` for the first of several"),
        (
            lambda: asyncio.run(missing_to_gold(CraneConfigurer)),
            "and not the class CraneConfigurer: name its distribut",
        ),
        (lambda: asyncio.run(until(True)), r"write `until\(lambda: …\)`, and not True"),
        (lambda: asyncio.run(until(bool, 0.2)), "write `timeout_s=0.2` for a bound"),
        (lambda: build(NothingConfigurer), r"configure\(\) returned None instead of a handler"),
    ],
)
def test_what_means_nothing_to_the_kit_is_told(make: Callable[[], object], said: str) -> None:
    with pytest.raises((TypeError, ValueError, ConfigError), match=said):
        make()


@pytest.mark.parametrize(
    ("entries", "network", "said"),
    [
        (
            [Doubtful("it")],
            None,
            r"takes what `connector\(ItsConfigurer, label=…\)` returns, .* an instance of Doubtful",
        ),
        ([BothConfigurer], None, r"takes what `connector\(ItsConfigurer, label=…\)` returns, and not BothConfigurer"),
        ([], "4g", r"write `network=impaired_network\('4g'\)`"),
    ],
)
async def test_what_is_joined_is_a_connector_and_its_network_no_name(entries: Any, network: Any, said: str) -> None:
    with pytest.raises(TypeError, match=said):
        async with joined(*entries, network=network):
            """Never."""
