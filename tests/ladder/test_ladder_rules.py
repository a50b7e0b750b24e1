"""Each rule of the ladder is broken by one change to a plugin that keeps them all, and says where."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import pytest
from pydantic import Field

from mosaic_core import Message, Request, RequestHandler
from mosaic_core.laboratory.joining import until
from mosaic_core.ladder.climb import RULES, climb, reached
from mosaic_core.ladder.fault import LEVELS, LadderLevel
from mosaic_core.ladder.lives import question_for
from mosaic_core.ladder.rule import RuleFinding, ShipmentRule
from mosaic_core.ladder.shipment import found_shipments
from mosaic_core.testing.pytest_plugin import InstallDistribution
from mosaic_core.words.errors import MosaicError
from tests.ladder.conftest import GoodPlugin

C, P, R = "acme_gauge/connector.py", "pyproject.toml", "README.md"
ASYNC_BODY = """    async def messages(self):
        for _ in self.every(self.params.period_s):"""
BODY = """    def messages(self) -> Iterator[Reading]:
        if self.params.port != "made-up":
            raise DeviceGone("unplugged")
        for _ in self.every(self.params.period_s):"""
SILENT = """    def messages(self) -> Iterator[Reading]:
        for _ in self.every(self.params.period_s):
            try:
                int("x")
            except ValueError:
                continue"""
DEAF = """    def messages(self) -> Iterator[Reading]:
        import time
        yield Reading(pressure=1.0)
        time.sleep(1.8)
        for _ in ():"""
LEAK = """    def messages(self) -> Iterator[Reading]:
        import threading
        threading.Thread(target=threading.Event().wait, name="acme-leak", daemon=True).start()
        for _ in self.every(self.params.period_s):"""
ONCE = """    def messages(self) -> Iterator[Reading]:
        if hasattr(self, "was_here"):
            raise RuntimeError("opened already")
        self.was_here = True
        for _ in self.every(self.params.period_s):"""

MESSAGES = "    def messages(self) -> Iterator[Reading]:"
WIDGET = "export const apiVersion = 1\nexport function Panel() {}\n"
SAFE = "    def make_safe(self, cause: str) -> None:\n        pass\n"
BREACHES = {
    "loads": (C, "from pydantic import Field", "from pydantic import Fieldd", "ImportError: cannot import"),
    "is-a-configurer": (P, "connector:WheelConfigurer", "connector:Wheel", "acme_gauge.connector:Wheel is no subclass"),
    "api-version": (C, '"""A gauge and a wheel."""', "MOSAIC_API_VERSION = 7", "it says MOSAIC_API_VERSION = 7"),
    "type-name": (C, 'connector_type = "acme-wheel"', 'connector_type = "wheels"', "connector_type is 'wheels'"),
    "docstring": (C, '    """A wheel that turns."""\n', "", "WheelConfigurer has no docstring"),
    "params-described": (C, ', description="Where it is plugged in."', "", "GaugeParams.port has no description"),
    "configures": (C, "return Wheel(self.label)", "return Wheel(self.labels)", "it raises AttributeError"),
    "widget": (
        C,
        MESSAGES,
        f'    widget = "acme-gauge/Panel"\n\n{MESSAGES}',
        "no installed distribution ships widgets",
    ),
    "licence": (P, 'license = "Apache-2.0"\n', "", "no licence is named"),
    "readme": (P, 'readme = "README.md"\n', "", "there is no readme"),
    "requires-python": (P, 'requires-python = ">=3.11"\n', "", "does not say which Python"),
    "dependencies": (
        P,
        'requires-python = ">=3.11"\n',
        'requires-python = ">=3.11"\ndependencies = ["mosaic-core>=9"]\n',
        'wants mosaic-core>=9, and 0.1.0 is installed: pip install "mosaic-core>=9"',
    ),
    "typed-messages": (C, "DataChannelReceivable[Turn]", "DataChannelReceivable", "Wheel has no type of message"),
    "message-units": (C, 'Field(json_schema_extra=unit("bar"))', "Field()", "Reading.pressure is a number without"),
    "param-units": (C, "period_s: float", "period: float", "GaugeParams.period is a number without a unit"),
    "starts-again": (C, BODY, ONCE, "run 2 ends with RuntimeError: opened already"),
    "hears-stop": (C, BODY, DEAF, "had not stopped after 1.5 s"),
    "device-gone": (C, 'raise DeviceGone("unplugged")', 'raise OSError("unplugged")', "it raises OSError: unplugged"),
    "blocks-nothing": (C, BODY, ASYNC_BODY, "for … in every(…) in an `async def`"),
    "tests-with-kit": ("tests/test_gauge.py", "mosaic_core.testing", "acme_gauge", "none of its tests imports"),
    "motion-guarded": (C, "    timeout_s = 0.3\n", "", "Wheel moves and has no timeout_s"),
    "safety-drill": (C, SAFE, "", "safe-action: "),
    "refuses-garbage": (C, "[Turn]):", "[bytes]):\n    motion_fields = ()", "it fails over"),
    "leaves-nothing": (C, BODY, LEAK, "more threads like 'acme-leak'"),
    "without-hardware": (C, 'default="made-up"', 'default="/dev/gauge"', "it ends with DeviceGone: unplugged"),
    "explained": (R, "period_s: 0.5", "period: 0.5", "the example is refused: "),
    "counts-losses": (C, BODY, SILENT, "leaves something out and tells nobody"),
}
"""By the rule: file, what stands there, what is written instead, and what the rule says."""
ELSEWHERE = {"only-owner", "py-typed", "wheels"}
"""Rules that no change of a text breaks."""


async def findings(
    plugin: GoodPlugin, *, only: tuple[str, ...] = (), level: LadderLevel = "gold", restarts: int = 3
) -> list[RuleFinding]:
    (shipment,) = found_shipments([str(plugin.folder)])
    return [one async for one in climb(shipment, level, restarts=restarts, only=only)]


def test_each_rule_has_its_breach() -> None:
    assert {rule.name for rule in RULES} == BREACHES.keys() | ELSEWHERE


def test_rules_have_names_of_their_own_and_say_everything_in_sentences() -> None:
    assert len({rule.name for rule in RULES}) == len(RULES)
    assert [rule.level for rule in RULES] == sorted((rule.level for rule in RULES), key=LEVELS.index)
    for rule in RULES:
        assert all(text.endswith((".", ")")) or '"' in text[-3:] for text in (rule.asks, rule.why, rule.cure)), (
            rule.name
        )


async def test_a_plugin_that_keeps_them_all_is_gold(plugin: GoodPlugin) -> None:
    found = await findings(plugin)
    assert [one for one in found if one.verdict in ("failed", "not judged")] == []
    assert reached(found) == "gold"
    assert {one.subject for one in found} == {"acme-gauge", "acme-wheel"}


async def test_a_widget_of_a_source_tree_needs_no_installation_but_its_file(plugin: GoodPlugin) -> None:
    plugin.spoil(C, MESSAGES, f'    widget = "acme-gauge/Panel"\n\n{MESSAGES}')
    named = '[project.entry-points."mosaic.widgets"]\nacme-gauge = "acme_gauge"\n\n[project.entry-points'
    plugin.spoil(P, "[project.entry-points", named)
    (failed,) = [one for one in await findings(plugin, only=("widget",)) if one.verdict == "failed"]
    assert "has no file" in failed.faults[0].message
    module = plugin.folder / "acme_gauge" / "acme-gauge.js"
    module.write_text(WIDGET)
    assert [one for one in await findings(plugin, only=("widget",)) if one.verdict == "failed"] == []
    module.write_text(WIDGET.replace("= 1", "= 9"))
    (failed,) = [one for one in await findings(plugin, only=("widget",)) if one.verdict == "failed"]
    (fault,) = failed.faults
    assert "can't load the widget 'acme-gauge/Panel': it is for apiVersion 9" in fault.message
    assert str(fault.place) == f"{module}:1"


async def test_a_source_tree_is_judged_beside_an_older_wheel_of_it_that_is_installed(
    plugin: GoodPlugin, install_distribution: InstallDistribution
) -> None:
    plugin.spoil(C, MESSAGES, f'    widget = "acme-gauge/Panel"\n\n{MESSAGES}')
    widgets = '[project.entry-points."mosaic.widgets"]\nacme-gauge = "acme_gauge"\n\n[project.entry-points'
    plugin.spoil(P, "[project.entry-points", widgets)
    (plugin.folder / "acme_gauge" / "acme-gauge.js").write_text(WIDGET)
    connectors = {"acme-gauge": "acme_gauge.connector:GaugeConfigurer"}
    installed = {"mosaic.connectors": connectors, "mosaic.widgets": {"acme-gauge": "acme_gauge"}}
    install_distribution("Acme_Gauge", version="0.9.0", entry_points=installed)
    found = await findings(plugin, only=("widget", "only-owner"))
    assert [one.faults for one in found if one.verdict == "failed"] == []
    install_distribution("acme-rival", entry_points=installed | {"mosaic.widgets": {"acme-gauge": "acme_rival"}})
    found = await findings(plugin, only=("widget", "only-owner"))
    told = sorted(fault.message.partition(": ")[2] or fault.message for one in found for fault in one.faults)
    assert told == [
        "acme-rival 1.0.0 has the type 'acme-gauge' too",
        "the widgets 'acme-gauge' are claimed by acme-rival 1.0.0 and acme_gauge",
    ]


async def test_an_entry_point_that_is_no_class_of_a_module_is_told_by_its_line(plugin: GoodPlugin) -> None:
    plugin.spoil(P, "acme_gauge.connector:GaugeConfigurer", "acme_gauge.connector GaugeConfigurer")
    found = {(one.rule.name, one.subject): one for one in await findings(plugin, only=("loads", "py-typed"))}
    (fault,) = found["loads", "acme-gauge"].faults
    assert fault.message == "its entry point is 'acme_gauge.connector GaugeConfigurer', which is no module:Class"
    assert (Path(fault.place.file).name, fault.place.line) == ("pyproject.toml", 9)
    assert [one.verdict for name, one in found.items() if name != ("loads", "acme-gauge")] == ["passed", "passed"]


@pytest.mark.parametrize("said", ["", "    requires_lease = True\n    motion_fields = ()\n"])
async def test_nothing_is_asked_of_a_safe_action_alone_or_of_a_switch(plugin: GoodPlugin, said: str) -> None:
    plugin.spoil(C, '    timeout_s = 0.3\n    requires_lease = True\n    motion_fields = ("speed_mps",)\n', said)
    (found,) = [one for one in await findings(plugin, only=("motion-guarded",)) if one.subject == "acme-wheel"]
    assert (found.verdict, found.faults) == ("does not apply", ())


async def test_what_moves_on_the_event_loop_is_told(plugin: GoodPlugin) -> None:
    plugin.spoil(C, "    def handle_data(", "    async def handle_data(")
    (found,) = [one for one in await findings(plugin, only=("motion-guarded",)) if one.subject == "acme-wheel"]
    assert "Wheel moves in an `async def handle_data`" in found.faults[0].message


@pytest.mark.parametrize("name", BREACHES)
async def test_a_breach_of_a_rule_is_told_with_its_place(plugin: GoodPlugin, name: str) -> None:
    file, old, new, told = BREACHES[name]
    if name == "refuses-garbage":
        plugin.spoil(file, "        pass\n\n    def make_safe", "        int(data)\n\n    def make_safe")
        plugin.spoil(file, '    timeout_s = 0.3\n    requires_lease = True\n    motion_fields = ("speed_mps",)\n', "")
    if name == "safety-drill":  # a time-out without a safe action is refused when the class is made
        plugin.spoil(file, "    timeout_s = 0.3\n", "")
    plugin.spoil(file, old, new)
    found = [one for one in await findings(plugin, only=(name,)) if one.verdict == "failed"]
    (fault, *_) = found[0].faults
    assert told in fault.message
    assert fault.place.file.startswith(str(plugin.folder))
    if not isinstance(found[0].rule, ShipmentRule) and file == C:
        assert fault.place.line is not None


WHEEL = """    def handle_data(self, data: Turn) -> None:
        pass

    def make_safe(self, cause: str) -> None:
        pass
"""
WAITS_FOR_A_LOCK = """    def handle_data(self, data: Turn) -> None:
        import threading

        self.lock = vars(self).get("lock") or threading.Lock()
        with self.lock:
            threading.Event().wait(0.6)

    def make_safe(self, cause: str) -> None:
        with self.lock:
            pass
"""
REFUSES_ALL = """    def handle_data(self, data: Turn) -> None:
        from mosaic_core import Refused

        raise Refused("acme.not_armed", "arm it first")

    def make_safe(self, cause: str) -> None:
        pass
"""
TYPE, TRIED = '    connector_type = "acme-wheel"\n', '    connector_type = "acme-wheel"\n    trial = {}\n'


@pytest.mark.parametrize(
    ("body", "kind", "told"),
    [
        (WAITS_FOR_A_LOCK, TRIED, "; handle_data ran meanwhile: make_safe must take no lock that it holds"),
        (WAITS_FOR_A_LOCK, TYPE, ""),
        (REFUSES_ALL, TRIED, ""),
        (WHEEL, TRIED, ""),
    ],
)
async def test_what_moves_is_driven_on_the_device_that_its_author_has_made_up_and_on_no_other(
    plugin: GoodPlugin, body: str, kind: str, told: str
) -> None:
    plugin.spoil(C, WHEEL, body)
    plugin.spoil(C, TYPE, kind)
    (found,) = [one for one in await findings(plugin, only=("safety-drill",)) if one.subject == "acme-wheel"]
    assert (found.verdict == "failed") == bool(told), found.faults
    for fault in found.faults:
        assert fault.message.startswith("stop: ")
        assert told in fault.message


WHOLE_WHEEL = """class Wheel(DataChannelReceivable[Turn]):
    delivery = Delivery.LATEST
    timeout_s = 0.3
    requires_lease = True
    motion_fields = ("speed_mps",)

"""
ASKED = "class Wheel(RequestHandler[Turn, Turn]):\n"
HEARS_NOTHING = """    def answer(self, question, request):
        import threading
        threading.Event().wait(2.0)  # a device that takes its time
        return question
"""
SWALLOWS_THE_END = """    async def answer(self, question, request):
        import asyncio
        for _ in range(20):
            try:
                await asyncio.sleep(0.1)
            except asyncio.CancelledError:
                pass
        globals()["ENDED"] = True
        return question
"""
HEARS = """    def answer(self, question, request):
        request.progress({"percent": 0})
        request.pause(5.0)
        return question
"""


@pytest.mark.parametrize(
    ("body", "kind", "verdict", "line"),
    [
        (HEARS_NOTHING, TRIED, "failed", "wait(2.0)"),
        (SWALLOWS_THE_END, TRIED, "failed", "class WheelConfigurer"),
        (HEARS_NOTHING, TYPE, "passed", ""),
        (HEARS, TRIED, "passed", ""),
    ],
)
async def test_what_answers_must_hear_its_end_and_is_asked_where_its_device_is_made_up(
    plugin: GoodPlugin, body: str, kind: str, verdict: str, line: str
) -> None:
    plugin.spoil(C, WHOLE_WHEEL, ASKED)
    plugin.spoil(C, WHEEL, body)
    plugin.spoil(C, TYPE, kind)
    plugin.spoil(C, "import DataChannelConfigurer", "import RequestHandler, DataChannelConfigurer")
    (found,) = [one for one in await findings(plugin, only=("hears-stop",)) if one.subject == "acme-wheel"]
    if body == SWALLOWS_THE_END:
        await until(lambda: hasattr(sys.modules["acme_gauge.connector"], "ENDED"))
    assert found.verdict == verdict
    for fault in found.faults:
        assert fault.place.line is not None
        assert line in Path(fault.place.file).read_text().splitlines()[fault.place.line - 1]


class Look(Message):
    duration_s: float = Field(ge=0, le=20)
    width_m: float = Field(gt=1)
    readings: int = 3


class Looker(RequestHandler[Look, Look]):
    def answer(self, question: Look, request: Request) -> Look:
        return question


def test_a_question_is_valid_and_takes_as_long_as_it_may() -> None:
    question = Look.model_validate_json(question_for(Looker("look")))
    assert (question.duration_s, question.readings) == (10.0, 3)


@pytest.mark.parametrize(
    ("said", "told"),
    [("barr", "has a unit that nobody knows, 'barr'; did you mean 'bar'?"), ("furlongz", "knows, 'furlongz'.")],
)
async def test_a_unit_that_nobody_knows_is_told_with_the_nearest(plugin: GoodPlugin, said: str, told: str) -> None:
    plugin.spoil(C, 'unit("bar")', f'unit("{said}")')
    (finding,) = [one for one in await findings(plugin, only=("message-units",)) if one.verdict == "failed"]
    assert finding.faults[0].message.endswith(told)


async def test_what_never_stops_is_named_by_the_line_where_it_hangs(plugin: GoodPlugin) -> None:
    plugin.spoil(C, BODY, DEAF)
    (finding,) = [one for one in await findings(plugin, only=("hears-stop",)) if one.verdict == "failed"]
    (fault,) = finding.faults
    assert fault.place.line is not None
    assert "time.sleep(1.8)" in Path(fault.place.file).read_text().splitlines()[fault.place.line - 1]


async def test_an_import_error_has_the_authors_traceback_and_line(plugin: GoodPlugin) -> None:
    plugin.spoil(C, "class Wheel(", "print(1 /\nclass Wheel(")
    one, other = await findings(plugin, only=("loads",))
    line = 1 + next(at for at, text in enumerate((plugin.folder / C).read_text().splitlines()) if "print(1" in text)
    assert one.faults[0].place.file == str(plugin.folder / C)
    assert one.faults[0].place.line in (line, line + 1)
    assert "SyntaxError" in other.faults[0].trace
    assert "importlib" not in other.faults[0].trace


async def test_what_can_not_be_loaded_is_judged_no_further(plugin: GoodPlugin) -> None:
    plugin.spoil(C, "from pydantic import Field", "import no_such_module")
    found = {one.rule.name: one.verdict for one in await findings(plugin) if one.subject == "acme-wheel"}
    assert found.pop("loads") == "failed"
    assert found.pop("only-owner") == "passed"
    assert set(found.values()) == {"not judged"}


async def test_what_blocks_the_loop_is_not_run(plugin: GoodPlugin) -> None:
    plugin.spoil(C, BODY, ASYNC_BODY)
    one, _ = await findings(plugin, only=("starts-again",))
    assert one.verdict == "not judged"


async def test_a_missing_py_typed_is_told(plugin: GoodPlugin) -> None:
    (plugin.folder / "acme_gauge" / "py.typed").unlink()
    (one,) = await findings(plugin, only=("py-typed",))
    assert one.faults[0].message == "acme_gauge/py.typed is missing"


async def test_compiled_code_needs_a_wheel_for_each_machine(plugin: GoodPlugin) -> None:
    (plugin.folder / "acme_gauge" / "fast.c").write_text("")
    (one,) = await findings(plugin, only=("wheels",))
    assert one.verdict == "not judged"
    (plugin.folder / "dist").mkdir()
    (plugin.folder / "dist" / "acme_gauge-1.0.0-cp311-cp311-linux_x86_64.whl").write_text("")
    (one,) = await findings(plugin, only=("wheels",))
    assert [fault.message for fault in one.faults] == ["there is no wheel for aarch64"]


async def test_a_type_that_another_distribution_has_is_told(
    plugin: GoodPlugin, install_distribution: InstallDistribution
) -> None:
    install_distribution("other-wheel", entry_points={"mosaic.connectors": {"acme-wheel": "nowhere:Nothing"}})
    _, wheel = await findings(plugin, only=("only-owner",))
    assert wheel.faults[0].message == "other-wheel 1.0.0 has the type 'acme-wheel' too"
    assert wheel.faults[0].place.line == 10


async def test_an_installed_distribution_without_sources_has_no_tests_to_judge(
    plugin: GoodPlugin, install_distribution: InstallDistribution
) -> None:
    install_distribution("acme-lone", entry_points={"mosaic.connectors": {"lone": "nowhere:Nothing"}})
    (shipment,) = found_shipments(["acme-lone"])
    found = {one.rule.name: one.verdict async for one in climb(shipment)}
    assert found["tests-with-kit"] == "not judged"
    assert found["licence"] == "failed"


async def test_what_a_program_has_set_aside_from_the_collector_stays_aside(plugin: GoodPlugin) -> None:
    gc.collect()
    gc.freeze()
    await findings(plugin, only=("licence",))
    assert gc.get_freeze_count() > 0


def test_a_rung_is_reached_when_nothing_below_is_missing() -> None:
    by_level = {level: next(rule for rule in RULES if rule.level == level) for level in LEVELS}
    passed = [RuleFinding(by_level[level], "x", "passed") for level in LEVELS]
    assert reached(passed) == "gold"
    assert reached([*passed, RuleFinding(by_level["gold"], "x", "not judged")]) == "silver"
    assert reached([*passed, RuleFinding(by_level["silver"], "x", "failed")]) == "bronze"
    assert reached([*passed, RuleFinding(by_level["bronze"], "x", "failed")]) is None


def test_words_name_a_distribution_a_type_or_a_folder(plugin: GoodPlugin, tmp_path: Path) -> None:
    (by_type,) = found_shipments(["cmd-vel"])
    assert by_type.name == "mosaic-cmdvel"
    assert [one.name for one in found_shipments(["mosaic-camera"])[0].connectors()] == [
        "camera", "opencv-sender-camera", "test-pattern",
    ]  # fmt: skip
    assert [one.name for one in found_shipments(["camera", "test-pattern"])[0].connectors()] == [
        "camera",
        "test-pattern",
    ]
    with pytest.raises(MosaicError, match="no distribution, folder or connector type 'camra'") as told:
        found_shipments(["camra"])
    assert "did you mean 'camera'" in told.value.cure
    with pytest.raises(MosaicError, match=r"has no pyproject\.toml"):
        found_shipments([str(tmp_path)])


NAMELESS = """    def messages(self) -> Iterator[Reading]:
        import threading
        threading.Thread(target=threading.Event().wait, daemon=True).start()
        for _ in self.every(self.params.period_s):"""
KEPT = """    def messages(self) -> Iterator[Reading]:
        import os, weakref
        file = os.open("/dev/null", os.O_RDONLY)
        weakref.finalize(self, os.close, file)
        for _ in self.every(self.params.period_s):"""


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (NAMELESS, "after 3 restarts there are 3 more threads like 'Thread (wait)'"),
        pytest.param(
            KEPT,
            "after 3 restarts of the same handlers there are 3 more open files like '/dev/null'",
            marks=pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="nobody says which files are open"),
        ),
    ],
)
async def test_threads_without_a_name_and_what_a_handler_keeps_are_left_behind_too(
    plugin: GoodPlugin, body: str, told: str
) -> None:
    plugin.spoil(C, BODY, body)
    (finding,) = [one for one in await findings(plugin, only=("leaves-nothing",)) if one.verdict == "failed"]
    assert finding.faults[0].message == told
