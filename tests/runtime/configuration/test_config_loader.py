"""The robot's file: all mistakes at once, each with its line, its place, what was expected, and the nearest name."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest

from mosaic_core.runtime.configuration.config_loader import Validation, check_config, load_config
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.words.config import AuthConfig, AuthParams, ConnectorConfig, RobotConfig, ServerConfig
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConfigError, Problem

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
Check = Callable[..., Validation]
Problems = Callable[..., tuple[Problem, ...]]
RobotYaml = Callable[..., str]


def config_of(validation: Validation) -> RobotConfig:
    assert validation.problems == ()
    assert validation.checked is not None
    return validation.checked.config


def only(problems: tuple[Problem, ...]) -> Problem:
    (problem,) = problems
    return problem


def test_the_example_of_the_documentation_loads(check: Check) -> None:
    validation = check(
        f"""\
server:
  ws_url: wss://mosaic.example.org
  auth: {{ type: simple-token, robot_id: {ROBOT_ID}, params: {{ token: ${{MOSAIC_TOKEN}} }} }}
  webrtc: {{ ice_servers: [ {{ urls: ["turn:turn.example.org:3478"], username: u, credential: c }} ] }}
connectors:
  - {{ type: eye, label: front }}
  - type: motor
    label: cmd_vel
    params: {{ pin: 3 }}
    safety: {{ timeout_s: 0.3, max_mps: 0.8 }}
    delivery: latest
""",
        {"MOSAIC_TOKEN": "s3cret: { } #"},
    )
    config = config_of(validation)
    assert config.server.auth.params.token is not None
    assert config.server.auth.params.token.get_secret_value() == "s3cret: { } #"
    assert config.connectors[1].delivery == DeliveryContract(mode=Delivery.LATEST)
    assert validation.checked is not None
    assert validation.checked.connectors[1].safety.model_dump(exclude_unset=True) == {"timeout_s": 0.3, "max_mps": 0.8}


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file(problems: Problems) -> None:
    found = problems(
        f"""\
version: 2
server:
  ws_url: wss://mosaic.example.org/path
  auth: {{ type: simple-tokn, robot_id: 5, params: {{ token: a }} }}
connectors:
  - {{ type: guage, label: a }}
  - {{ type: gauge, label: a, delivery: newest, params: {{ perod_s: 1, period_s: 0, mode: fst }} }}
  - {{ type: motor, label: _b, parms: {{}} }}
  - {{ type: motor, params: {{ pin: x }}, safety: {{ timeout_s: 1000, max_mps: -1 }} }}
# {ROBOT_ID}
"""
    )
    assert [(problem.line, problem.path) for problem in found] == [
        (1, "version"),
        (3, "server.ws_url"),
        (4, "server.auth.type"),
        (4, "server.auth.robot_id"),
        (6, "connectors[0].type"),
        (7, "connectors[1].delivery"),
        (7, "connectors[1].label"),
        (7, "connectors[1].params.period_s"),
        (7, "connectors[1].params.mode"),
        (7, "connectors[1].params.perod_s"),
        (8, "connectors[2].label"),
        (8, "connectors[2].parms"),
        (8, "connectors[2].params.pin"),
        (9, "connectors[3].label"),
        (9, "connectors[3].params.pin"),
        (9, "connectors[3].safety.timeout_s"),
        (9, "connectors[3].safety.max_mps"),
    ]
    by_path = {problem.path: problem for problem in found}
    assert by_path["server.auth.type"].cure == "did you mean 'simple-token'?"
    assert by_path["server.ws_url"].message.startswith("expected a URL without a path such as wss://")
    assert "did you mean 'gauge'?" in by_path["connectors[0].type"].cure
    assert by_path["connectors[0].type"].code == "config.unknown_type"
    assert "expected 'reliable', 'latest' or 'bulk', got 'newest'" in by_path["connectors[1].delivery"].message
    assert by_path["connectors[1].params.perod_s"].cure == "did you mean 'period_s'?"
    assert by_path["connectors[1].params.period_s"].message == "expected a number > 0, got 0"
    assert by_path["connectors[1].params.mode"].cure == "did you mean 'fast'?"
    assert "reserved" in by_path["connectors[2].label"].message
    assert by_path["connectors[2].parms"].cure == "did you mean 'params'?"
    assert by_path["connectors[2].params.pin"].message == "'pin' is missing"
    assert by_path["connectors[3].params.pin"].message == "expected a whole number, got 'x'"
    assert by_path["connectors[1].label"].code == "config.duplicate_label"


def test_the_line_is_that_of_the_key_in_block_style(problems: Problems, robot_yaml: RobotYaml) -> None:
    problem = only(
        problems(robot_yaml("\n  - type: gauge\n    label: a\n    params:\n      port: x\n      period_s: fast"))
    )
    assert (problem.line, problem.path) == (10, "connectors[0].params.period_s")
    assert str(problem).endswith(":10: connectors[0].params.period_s: expected a number, got 'fast'")


# -- older spellings -----------------------------------------------------------------------------------------------


def test_upstreams_and_historic_spellings_load(check: Check) -> None:
    validation = check(
        f"""\
server:
  ws_url: wss://example.org
  auth_config: {{ type: token, robot_id: {ROBOT_ID}, params: {{ token: 0123 }} }}
  webrtc_config:
    ice_servers:
      - {{ urls: turn.example.org:3478, username: u, credential: 123 }}
      - {{ urls: "stun:stun.example.org" }}
      - {{ urls: ["turn:turn.example.org:3478?transport=tcp"], username: u, credential: c }}
connectors:
  - {{ type: gauge, label: front-gauge, params: {{ period_s: "0.5", serial_number: 007, channels: ["1", 2] }} }}
"""
    )
    config = config_of(validation)
    assert config.server.auth.type == "simple-token"
    assert config.server.auth.params.token is not None
    assert config.server.auth.params.token.get_secret_value() == "0123"
    assert [server.urls for server in config.server.webrtc.ice_servers] == [
        ("turn:turn.example.org:3478?transport=udp",),
        ("stun:stun.example.org:3478",),
        ("turn:turn.example.org:3478?transport=tcp",),
    ]
    assert config.server.webrtc.ice_servers[0].credential == "123"
    assert validation.checked is not None
    assert validation.checked.connectors[0].params.model_dump() == {
        "port": "/dev/ttyUSB0",
        "period_s": 0.5,
        "mode": "fast",
        "serial_number": "007",
        "channels": (1, 2),
    }


@pytest.mark.parametrize("text", ["12:30", "yes", "2026-01-02", "1e3", "0x10", "~x"])
def test_text_stays_as_it_was_written(check: Check, robot_yaml: RobotYaml, text: str) -> None:
    validation = check(robot_yaml(f"[{{ type: gauge, label: a, params: {{ serial_number: {text} }} }}]"))
    assert validation.checked is not None
    assert validation.checked.connectors[0].params.model_dump()["serial_number"] == text


def test_keys_without_a_value_count_as_absent(check: Check) -> None:
    text = f"""\
version:
server:
  ws_url: wss://example.org
  auth: {{ type: no-authorization, robot_id: {ROBOT_ID}, params: }}
  webrtc:
connectors:
"""
    assert config_of(check(text)).connectors == ()
    text = text.replace("connectors:", "connectors: [{type: gauge, label: a, params: , safety: , delivery: }]")
    assert config_of(check(text)).connectors[0].params == {}


def test_params_beside_the_label_are_told_where_they_belong(problems: Problems, robot_yaml: RobotYaml) -> None:
    problem = only(problems(robot_yaml("[{ type: gauge, label: a, period_s: 2 }]")))
    assert (problem.message, problem.cure) == ("unknown key 'period_s'", "write it as params.period_s")


def test_a_token_beside_the_robots_id_is_told_where_it_belongs(problems: Problems, robot_yaml: RobotYaml) -> None:
    text = robot_yaml().replace("params: { token: abc }", "token: abc")
    by_path = {problem.path: problem for problem in problems(text)}
    assert by_path["server.auth.token"].cure == "write it as server.auth.params.token"


def test_a_section_in_both_spellings_is_a_mistake(problems: Problems, robot_yaml: RobotYaml) -> None:
    text = robot_yaml(server="  webrtc: {}\n  webrtc_config: {}\n")
    assert only(problems(text)).path == "server.webrtc_config"


# -- what must be there --------------------------------------------------------------------------------------------


def test_missing_sections_are_named(problems: Problems) -> None:
    assert only(problems("connectors: []")).message == "neither a server nor connectors: 'server' is missing"
    found = problems("server:\n  auth: { type: no-authorization }\n")
    assert [(problem.line, problem.path) for problem in found] == [(1, "server.ws_url"), (2, "server.auth.robot_id")]
    assert found[0].cure == "The server, without a path: wss://mosaic.example.org"


def test_without_a_server_it_is_a_robot_for_its_own_network(check: Check) -> None:
    validation = check("connectors:\n  - { type: eye, label: front }\n")
    assert config_of(validation).server is None
    [hint] = validation.hints
    assert "its own network" in hint.message
    assert "mosaic run --serve" in hint.cure


@pytest.mark.parametrize("params", ["", "params: {}", "params: { token: '' }"])
def test_a_token_must_be_there(problems: Problems, robot_yaml: RobotYaml, params: str) -> None:
    problem = only(problems(robot_yaml().replace("params: { token: abc }", params)))
    assert (problem.path, problem.line) == ("server.auth", 4)
    assert "simple-token needs params.token" in problem.message


def test_a_variable_that_is_set_but_empty_is_named(robot_yaml: RobotYaml, check: Check) -> None:
    text = robot_yaml().replace("token: abc", "token: '${MOSAIC_EMPTY}'")
    problem = only(check(text, {"MOSAIC_EMPTY": ""}).problems)
    assert (problem.path, problem.code) == ("server.auth", "config.invalid")
    assert "${MOSAIC_EMPTY} is set, but empty" in problem.message


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_a_web_address_of_the_server_is_told_with_the_scheme_that_is_right(
    problems: Problems, robot_yaml: RobotYaml, scheme: str
) -> None:
    problem = only(problems(re.sub("wss://[^ \n]+", f"{scheme}://127.0.0.1:19612", robot_yaml(), count=1)))
    assert "expected a URL that begins with ws:// or wss://" in problem.message
    assert problem.cure == f"write {scheme.replace('http', 'ws')}:// instead of {scheme}://"


@pytest.mark.parametrize(
    ("connectors", "message"),
    [
        ("5", "expected a list, got 5"),
        ("[x]", "expected a mapping of keys to values, got 'x'"),
        ("[{type: gauge, label: a, params: [1]}]", "expected a mapping of keys to values, got a list"),
        ("[{type: gauge, label: a, safety: 3}]", "expected a mapping of keys to values, got 3"),
        ("[{type: [gauge], label: a}]", "expected text, got a list"),
        ("[{type: gauge, label: {}}]", "expected text"),
    ],
)
def test_the_wrong_shape_is_told_once(problems: Problems, robot_yaml: RobotYaml, connectors: str, message: str) -> None:
    assert only(problems(robot_yaml(connectors))).message == message


def test_keys_that_are_written_as_a_list_are_told_how_to_be(problems: Problems, robot_yaml: RobotYaml) -> None:
    found = only(problems(robot_yaml("[{type: gauge, label: a, params: [{period_s: 1}]}]")))
    assert (found.path, found.cure) == ("connectors[0].params", "write its keys without `- `")


@pytest.mark.parametrize("label", ["_mosaic", "", "a b", "ä", "x" * 65, "-a"])
def test_labels_that_cannot_be_channels_are_refused(problems: Problems, robot_yaml: RobotYaml, label: str) -> None:
    assert only(problems(robot_yaml(f"[{{type: gauge, label: '{label}'}}]"))).path == "connectors[0].label"


def test_labels_are_compared_as_they_are_written(problems: Problems, robot_yaml: RobotYaml) -> None:
    problem = only(problems(robot_yaml("\n  - {type: gauge, label: 1}\n  - {type: gauge, label: '1'}")))
    assert problem.message == "the label '1' is taken by connectors[0], line 6"


@pytest.mark.parametrize(
    ("url", "is_good"),
    [
        ("ws://127.0.0.1:9001", True),
        ("wss://[::1]:9001/", True),
        ("wss://[", False),
        ("wss://[]", False),
        ("wss://:9001", False),
        ("ws://host:99999", False),
        ("ws://host:x", False),
        ("ws://user:secret@host", False),
        ("ws://host/path", False),
        ("ws://host?x", False),
        ("host:9001", False),
    ],
)
def test_the_servers_url_is_one_that_can_be_opened(
    problems: Problems, robot_yaml: RobotYaml, url: str, is_good: bool
) -> None:
    found = problems(robot_yaml().replace("wss://mosaic.example.org", f"'{url}'"))
    assert [problem.path for problem in found] == ([] if is_good else ["server.ws_url"])


# -- secrets -------------------------------------------------------------------------------------------------------


def test_a_type_or_label_from_the_environment_is_quoted_as_it_was_written(
    problems: Problems, robot_yaml: RobotYaml
) -> None:
    text = robot_yaml(
        "\n  - { type: '${SECRET}', label: a }"
        "\n  - { type: gauge, label: '${SECRET}' }"
        "\n  - { type: gauge, label: '${SECRET}' }"
    )
    found = problems(text, environ={"SECRET": "hunter2"})
    assert [one.code for one in found] == ["config.unknown_type", "config.duplicate_label"]
    assert all("'${SECRET}'" in one.message for one in found)
    assert "hunter2" not in str(found)


def test_secrets_are_quoted_nowhere(problems: Problems, robot_yaml: RobotYaml) -> None:
    found = problems(
        robot_yaml("[{type: gauge, label: a, params: {period_s: '${SECRET}'}}]").replace("token: abc", "token: [hush]"),
        {"SECRET": "hush"},
    )
    assert len(found) == 2
    assert "hush" not in " ".join(map(str, found))


def test_no_cure_is_made_of_a_value_from_the_environment(check: Check, robot_yaml: RobotYaml) -> None:
    text = robot_yaml(
        "[{type: gauge, label: '${LABEL}'}, {type: '${TYPE}', label: b},"
        " {type: gauge, label: c, params: {mode: '${MODE}'}}, {type: gauge, label: d, params: {prt: '${PORT}'}}]"
    )
    environ = {"LABEL": "Hunter2-Swordfish", "TYPE": "guage", "MODE": "fastt", "PORT": "x"}
    found = check(text, environ)
    assert [one.cure for one in found.problems] == ["", "", "did you mean 'port'?"]
    assert found.problems[0].message == "no connector type '${TYPE}'"
    clean = check(robot_yaml("[{type: gauge, label: '${LABEL}'}]"), environ)
    assert [(one.message, one.cure) for one in clean.hints] == [("the label '${LABEL}' is not snake_case", "")]


def test_a_value_from_the_environment_is_hidden_as_part_of_a_longer_name(check: Check, robot_yaml: RobotYaml) -> None:
    text = robot_yaml("[{type: eye, label: '${LABEL}'}, {type: watcher, label: b, params: {main: quite_other}}]")
    one = check(text, {"LABEL": "swordfish"})
    assert one.checked is not None
    place = ("connectors", 1, "params", "main")
    assert "swordfish" not in str(one.document.problem(place, "it has: swordfish", cure="see Swordfish/left"))


# -- environment ---------------------------------------------------------------------------------------------------


def test_a_missing_variable_is_an_error_with_its_line(problems: Problems, robot_yaml: RobotYaml) -> None:
    problem = only(problems(robot_yaml().replace("token: abc", "token: ${ROBOT_TOKEN}")))
    assert problem.code == "config.missing_env"
    assert (problem.line, problem.path) == (4, "server.auth.params.token")
    assert problem.message == "the environment variable ROBOT_TOKEN is not set"


def test_missing_variables_can_be_forgiven_and_other_mistakes_are_still_told(
    check: Check, robot_yaml: RobotYaml
) -> None:
    text = robot_yaml("[{type: gauge, label: '${L}', params: {period_s: '${P}', mod: 1}}, {type: '${T}', label: b}]")
    text = text.replace(ROBOT_ID, "${ID}").replace("wss://mosaic.example.org", "${URL}")
    assert len(check(text).problems) == 6
    forgiven = check(text, allow_missing_env=True)
    assert only(forgiven.problems).path == "connectors[0].params.mod"
    forgiven = check(text.replace(", mod: 1", ""), allow_missing_env=True)
    assert (forgiven.problems, forgiven.checked) == ((), None)


def test_nothing_starts_on_forgiven_values(write: Callable[[str], Path], robot_yaml: RobotYaml, acme: Any) -> None:
    with pytest.raises(ConfigError, match="X is not set"):
        load_config(write(robot_yaml().replace("token: abc", "token: ${X}")), resolver=acme, environ={})


def test_values_from_the_environment_are_read_as_what_the_param_wants(check: Check, robot_yaml: RobotYaml) -> None:
    validation = check(
        robot_yaml("[{type: gauge, label: a, params: {period_s: ${P}, port: ${D}}}]"), {"P": "2", "D": "5"}
    )
    assert validation.checked is not None
    assert validation.checked.connectors[0].params.model_dump()["period_s"] == 2.0
    assert validation.checked.connectors[0].params.model_dump()["port"] == "5"


# -- Python --------------------------------------------------------------------------------------------------------


def robot_config(*connectors: ConnectorConfig) -> RobotConfig:
    params = AuthParams.model_validate({"token": "abc"})
    auth = AuthConfig(type="simple-token", robot_id=UUID(ROBOT_ID), params=params)
    return RobotConfig(server=ServerConfig(ws_url="wss://example.org", auth=auth), connectors=connectors)


def test_a_configuration_made_in_python_is_checked_too(acme: ConnectorResolver) -> None:
    checked = check_config(
        robot_config(ConnectorConfig(type="gauge", label="a", params={"period_s": 2})), resolver=acme
    )
    assert checked.connectors[0].params.model_dump()["period_s"] == 2
    with pytest.raises(ConfigError) as caught:
        check_config(robot_config(ConnectorConfig(type="gauge", label="a", params={"perid_s": 2})), resolver=acme)
    problem = only(caught.value.problems)
    assert (problem.path, problem.line, problem.cure) == (
        "connectors[0].params.perid_s",
        None,
        "did you mean 'period_s'?",
    )


# -- hints ---------------------------------------------------------------------------------------------------------


def test_hints_are_no_mistakes(check: Check, robot_yaml: RobotYaml) -> None:
    text = robot_yaml("[{type: motor, label: CMD-vel, params: {pin: 1}, safety: {timeout_s: 0.3}}]").replace(
        "wss:", "ws:"
    )
    validation = check(text)
    assert validation.problems == ()
    assert [hint.path for hint in validation.hints] == ["server.ws_url", "connectors[0].label"]
    assert "'cmd_vel' would be the usual spelling" in validation.hints[1].cure


def test_a_journal_in_a_folder_that_is_not_there_is_hinted_at(
    check: Check, robot_yaml: RobotYaml, tmp_path: Path
) -> None:
    def hints(file: Path) -> list[str]:
        return [hint.path for hint in check(robot_yaml() + f"control: {{journal_file: '{file}'}}\n").hints]

    assert hints(tmp_path / "journal.jsonl") == []
    assert hints(tmp_path / "nowhere" / "journal.jsonl") == ["control.journal_file"]


def test_a_turn_server_without_credentials_is_hinted_at(check: Check, robot_yaml: RobotYaml) -> None:
    validation = check(
        robot_yaml(server="  webrtc: { ice_servers: [{urls: t.example.org}, {urls: 'stun:s.example.org'}] }\n")
    )
    assert [hint.path for hint in validation.hints] == ["server.webrtc.ice_servers[0]"]
