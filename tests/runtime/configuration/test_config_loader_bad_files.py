"""Files that are no configuration at all: one clear error, never a traceback, never a hang."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mosaic_core.runtime.configuration.config_loader import load_config, validate_document
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.configuration.yaml_document import MAX_FILE_BYTES, parse_yaml, read_yaml
from mosaic_core.words.errors import ConfigError, Problem

Problems = Callable[..., tuple[Problem, ...]]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", None, "is empty"),
        ("# only a comment\n", None, "is empty"),
        ("---\n", 1, "must be a mapping"),
        ("- a\n- b\n", 1, "must be a mapping"),
        ("hello", 1, "must be a mapping"),
        ("a: 1\n---\nb: 2\n", 2, "more than one document"),
        ("server:\n\tws_url: x\n", 2, "not valid YAML"),
        ("server: [1, 2\n", 2, "not valid YAML"),
        ("server: 'x\n", 2, "not valid YAML"),
        ("server: *nobody\n", 1, "not valid YAML"),
        ("a: 1\nb: \x07\n", 2, "character U+0007 is not allowed"),
        (b"\xff\xfe\x00", 1, "is not UTF-8 text"),
        (b"a: 1\nb: \x80\n", 2, "is not UTF-8 text"),
        (b"\x7fELF\x00\x00", 1, "not allowed"),
        ("x: \ue700", 1, "character U+E700 is not allowed"),
    ],
)
def test_what_is_no_yaml_is_said_with_its_line(
    problems: Problems, text: str | bytes, line: int | None, message: str
) -> None:
    (problem,) = problems(text)
    assert message in problem.message
    assert problem.line == line
    assert problem.code == "config.syntax"


def test_tabs_get_a_cure(problems: Problems) -> None:
    (problem,) = problems("server:\n\tws_url: x\n")
    assert problem.cure == "indent with spaces, never with tabs"


def test_an_empty_file_gets_a_cure(problems: Problems) -> None:
    (problem,) = problems("")
    assert "mosaic config init" in problem.cure


def test_a_byte_order_mark_is_no_mistake(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    assert problems(b"\xef\xbb\xbf" + robot_yaml().encode()) == ()


def test_windows_line_ends_are_no_mistake(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    assert problems(robot_yaml().replace("\n", "\r\n")) == ()


@pytest.mark.parametrize("name", ["missing.yaml", "."])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config(tmp_path / name)
    (problem,) = caught.value.problems
    assert problem.code == "config.unreadable"
    assert problem.message.startswith("can't be read")
    assert problem.file == str(tmp_path / name)


def test_a_path_with_a_null_byte_is_named() -> None:
    with pytest.raises(ConfigError, match="can't be read"):
        load_config("robot\0.yaml")


def test_a_huge_file_is_refused_unread(problems: Problems) -> None:
    (problem,) = problems("a: b\n" * (MAX_FILE_BYTES // 4))
    assert problem.message == "larger than 256 KiB"


def test_an_endless_file_is_refused() -> None:
    with pytest.raises(ConfigError, match="larger than"):
        read_yaml(Path("/dev/zero"), {})


def test_duplicate_keys_are_told_with_both_lines(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    found = problems(robot_yaml(server="  ws_url: wss://other.example.org\n"))
    (problem,) = found
    assert (problem.line, problem.path) == (5, "server.ws_url")
    assert problem.message == "'ws_url' stands here twice, first in line 3"


@pytest.mark.parametrize("levels", [9, 30])
def test_aliases_that_multiply_are_stopped_early(problems: Problems, levels: int) -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 10)}]" for level in range(1, levels)]
    start = time.monotonic()
    (problem,) = problems("\n".join(lines))
    assert "more than" in problem.message
    assert "multiply" in problem.cure
    assert time.monotonic() - start < 10


@pytest.mark.parametrize("source", ["{}", "{ k: 1 }"])
def test_merges_that_multiply_are_stopped_early(problems: Problems, source: str) -> None:
    lines = [f"a0: &a0 {source}"]
    lines += [f"a{level}: &a{level} {{ <<: [{', '.join([f'*a{level - 1}'] * 10)}] }}" for level in range(1, 9)]
    (problem,) = problems("\n".join(lines))
    assert (problem.message, problem.cure) == ("more than 20000 values", "do aliases (*name) multiply?")


def test_merges_in_a_long_row_end(problems: Problems) -> None:
    rows = [f"a{number}: &a{number} {{ <<: *a{number - 1} }}" for number in range(1, 2000)]
    (problem,) = problems("\n".join(["a0: &a0 {}", *rows]))
    assert problem.message == "nested too deeply"


@pytest.mark.parametrize("text", ["a: &a\n  <<: *a", "a: &a\n  b: &b { <<: *a }", "a: &a\n  b: { <<: [{}, *a] }"])
def test_a_mapping_that_is_merged_into_itself_is_told_with_its_line(problems: Problems, text: str) -> None:
    line_of = {one.message: one.line for one in problems(text)}
    assert line_of["'<<' merges a mapping into itself"] in (1, 2)
    assert "unknown key 'a'" in line_of, "and all other mistakes beside it"


def test_what_is_written_out_wins_over_what_is_merged_and_the_first_merge_over_the_next() -> None:
    text = "a: &a { x: 1, y: 1 }\nb: &b { x: 2, y: 2, z: 2 }\nc: { x: 3, <<: [*a, *b] }"
    assert parse_yaml(text, "", {}).tree["c"] == {"x": 3, "y": 1, "z": 2}


def test_an_alias_to_itself_ends(problems: Problems) -> None:
    (problem,) = problems("a: &a [*a]")
    assert problem.code == "config.syntax"


@pytest.mark.parametrize("text", ["[" * 5000, "{a: " * 5000, "- " * 20000, "a: " + "[" * 80 + "]" * 80])
def test_deep_nesting_ends(problems: Problems, text: str) -> None:
    (problem,) = problems(text)
    assert (problem.code, problem.line) == ("config.syntax", 1)
    assert problem.message == "nested too deeply"


def test_aliases_and_merge_keys_work(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    text = robot_yaml(
        "\n  - { type: gauge, label: a, params: &p { period_s: 2, mode: slow } }"
        "\n  - { type: gauge, label: b, params: { <<: *p, period_s: 3 } }"
        "\n  - { type: gauge, label: c, params: { <<: [*p, *p], perid: 3 } }"
        "\n  - { type: gauge, label: d, params: { <<: 3 } }"
    )
    assert [problem.path for problem in problems(text)] == ["connectors[2].params.perid", "connectors[3].params"]


@pytest.mark.parametrize(
    "value", ["!!python/object/apply:os.system ['true']", "!custom 3", "!!binary aGk=", "!!set {a}"]
)
def test_tags_are_refused_and_run_nothing(problems: Problems, robot_yaml: Callable[..., str], value: str) -> None:
    found = problems(robot_yaml(f"[{{type: gauge, label: a, params: {{port: {value}}}}}]"))
    assert "is not supported" in found[0].message
    assert found[0].line == 5


def test_keys_must_be_words(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    found = problems(robot_yaml() + "? [a]\n: 3\n")
    assert found[0].message == "keys must be plain words"


def test_a_misspelt_key_is_not_missing_as_well(problems: Problems, robot_yaml: Callable[..., str]) -> None:
    found = problems(robot_yaml("[{type: lamp, lable: a}]"))
    told = [(one.path, one.message, one.cure) for one in found if "type" not in one.path]
    assert told == [("connectors[0].lable", "unknown key 'lable'", "did you mean 'label'?")]


@given(st.text(max_size=200))
@settings(max_examples=150, deadline=None)
def test_any_text_is_a_document_or_a_config_error(text: str) -> None:
    try:
        document = parse_yaml(text, "x.yaml", {})
    except ConfigError:
        return
    assert validate_document(document, ConnectorResolver([])).problems


DAMAGE = st.text(st.sampled_from("{}[]:-&*!|>'\"%@`,?#$ \n\tax0"), min_size=1, max_size=8)


@given(position=st.integers(0, 200), damage=DAMAGE)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_file_never_raises_anything_else(position: int, damage: str, robot_yaml: Callable[..., str]) -> None:
    text = robot_yaml("\n  - {type: x, label: a, params: {b: [1, ${C}]}}\n  - type: y\n    label: &l b\n")
    damaged = text[:position] + damage + text[position:]
    try:
        document = parse_yaml(damaged, "x.yaml", {})
    except ConfigError:
        return
    validate_document(document, ConnectorResolver([]))
