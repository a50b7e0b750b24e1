"""References in values: environment, files, the escape."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.runtime.configuration.config_env import (
    MASK_CHARACTERS,
    MAX_SECRET_BYTES,
    Filled,
    References,
    filled,
    masked,
    references_in,
    unmasked,
)


def test_variables_are_filled_in_anywhere_in_a_value() -> None:
    assert filled("wss://${HOST}:${PORT}", {"HOST": "h", "PORT": "1"}) == Filled("wss://h:1", True)
    assert filled("plain $HOME {x}", {}) == Filled("plain $HOME {x}")


def test_a_value_is_not_filled_in_twice() -> None:
    assert filled("${A}", {"A": "${B}", "B": "x"}).text == "${B}"


def test_two_dollars_are_the_characters_themselves() -> None:
    assert filled("$${A} ${A}", {"A": "x"}) == Filled("${A} x", True)


def test_files_are_read_without_their_last_newline(tmp_path: Path) -> None:
    secret = tmp_path / "token"
    secret.write_bytes(b"a\nb\r\n")
    assert filled(f"${{file:{secret}}}", {}).text == "a\nb"


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    result = filled(f"${{A}}${{B}}${{file:{tmp_path}/x}}${{file:{tmp_path}}}${{file:a\0b}}", {"B": ""})
    assert result.missing[0] == "the environment variable A is not set"
    assert f"{tmp_path}/x can't be read: No such file" in result.missing[1]
    assert "Is a directory" in result.missing[2]
    assert "can't be read" in result.missing[3]
    assert result.mistakes == ()


@pytest.mark.parametrize("text", ["${}", "${1a}", "${a b}", "${A:-x}", "${A", "a ${"])
def test_references_that_mean_nothing_are_mistakes(text: str) -> None:
    result = filled(text, {"A": "x"})
    assert len(result.mistakes) == 1
    assert result.missing == ()


def test_files_that_are_no_secrets_are_mistakes(tmp_path: Path) -> None:
    binary, huge = tmp_path / "binary", tmp_path / "huge"
    binary.write_bytes(b"\xff")
    huge.write_bytes(b"x" * (MAX_SECRET_BYTES + 1))
    assert "not UTF-8" in filled(f"${{file:{binary}}}", {}).mistakes[0]
    assert "larger than" in filled(f"${{file:{huge}}}", {}).mistakes[0]
    assert "larger than" in filled("${file:/dev/zero}", {}).mistakes[0]


@given(st.text(alphabet=st.sampled_from("ab${}[]:,#'\"\n &*"), max_size=60))
def test_masking_keeps_the_length_and_can_be_undone(text: str) -> None:
    hidden = masked(text)
    assert len(hidden) == len(text)
    assert hidden.count("\n") == text.count("\n")
    assert unmasked(hidden) == text


def test_nothing_special_is_left_inside_a_masked_reference() -> None:
    assert MASK_CHARACTERS.sub("_", masked("{ a: ${file:/x, y} }")) == "{ a: $_file_/x__y_ }"


def test_a_credential_is_read_from_the_folder_of_the_service(tmp_path: Path) -> None:
    (tmp_path / "token").write_text("abc\n")
    assert filled("${credential:token}", {"CREDENTIALS_DIRECTORY": str(tmp_path)}) == Filled("abc", True)
    assert "can't be read" in filled("${credential:other}", {"CREDENTIALS_DIRECTORY": str(tmp_path)}).missing[0]
    assert "services alone" in filled("${credential:token}", {}).missing[0]


@pytest.mark.parametrize("name", ["", "..", "../token", "/etc/passwd", "a b", "a:b", "x" * 129])
def test_a_credential_names_no_other_place(name: str, tmp_path: Path) -> None:
    result = filled(f"${{credential:{name}}}", {"CREDENTIALS_DIRECTORY": str(tmp_path)})
    assert "names no credential" in result.mistakes[0]


def test_all_references_are_found_by_kind_and_once() -> None:
    found = references_in(["${A}:${B}", "${credential:token} ${A}", "$${C} ${file:/x/y}"])
    assert found == References(("A", "B"), ("token",), ("/x/y",))
