"""The tables of words hold together: codes, catalogue, control messages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.codes import CLOSE_REASONS, REASONS, RESULT_REASONS, CloseCode, ResultCode
from mosaic_core.words.control import CONTROL_MESSAGES, Hello, parse_control
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.errors import ConfigError, MosaicError, Problem, WireError
from mosaic_core.words.wire_model import to_json

SOURCES = [
    path for root in ("mosaic_core", "plugins") for path in (Path(__file__).parents[2] / root).rglob("mosaic_*/**/*.py")
] + list((Path(__file__).parents[2] / "mosaic_core").rglob("*.py"))


def test_every_close_code_and_refusal_has_a_reason() -> None:
    assert set(CLOSE_REASONS) == set(CloseCode)
    assert set(CLOSE_REASONS.values()) <= set(REASONS)
    assert set(RESULT_REASONS.values()) <= set(REASONS)
    assert set(ResultCode) - set(RESULT_REASONS) <= {
        ResultCode.SUCCESS,
        ResultCode.UNKNOWN_EXCEPTION_OCCURRED,
        ResultCode.INVALID_ROBOT_AUTH_TYPE,
        ResultCode.USER_ALREADY_EXISTS,
    }


def test_reasons_are_sentences() -> None:
    for entry in REASONS.values():
        assert re.fullmatch(r"[a-z][a-z0-9]*\.[a-z0-9_]+", entry.code)
        assert entry.sentence.endswith(".")
        assert not entry.cure or entry.cure.endswith((".", "`."))


def test_every_code_in_the_sources_is_in_the_table() -> None:
    families = {code.split(".")[0] for code in REASONS}
    pattern = re.compile(rf'code="((?:{"|".join(sorted(families))})\.[a-z0-9_]+)"')
    used = {code for path in SOURCES for code in pattern.findall(path.read_text())}
    assert used, "the pattern finds nothing"
    assert used <= set(REASONS), used - set(REASONS)


def test_an_error_refuses_a_code_nobody_defined() -> None:
    with pytest.raises(KeyError):
        MosaicError("x", code="nobody.defined")


def test_a_config_error_lists_all_its_problems() -> None:
    error = ConfigError([Problem("a", file="f.yaml", line=3, path="x.y"), Problem("b", cure="do c")])
    assert str(error) == "f.yaml:3: x.y: a\nb (do c)"


@pytest.mark.parametrize(
    ("data_type", "direction"),
    [
        (MosaicDataType.JSON_R2U, Direction.TO_OPERATOR),
        (MosaicDataType.BYTE_U2R, Direction.TO_ROBOT),
        (MosaicDataType.JSON_BI, Direction.BOTH),
        (MosaicDataType.MEDIA, Direction.TO_OPERATOR),
    ],
)
def test_direction_follows_from_the_data_type(data_type: MosaicDataType, direction: Direction) -> None:
    assert data_type.direction is direction


def entry(label: str, schema: dict[str, object] | None = None) -> CatalogueEntry:
    return CatalogueEntry(
        label=label,
        type="battery",
        data_type=MosaicDataType.JSON_R2U,
        direction=Direction.TO_OPERATOR,
        message_schema=schema,
    )


def test_the_short_catalogue_keeps_the_hash_and_drops_the_schemas() -> None:
    full = Catalogue.of([entry("a", {"type": "object"})])
    assert full.short().hash == full.hash
    assert full.short().entries[0].message_schema is None


def test_the_hash_changes_with_the_content() -> None:
    assert Catalogue.of([entry("a")]).hash != Catalogue.of([entry("b")]).hash
    assert Catalogue.of([entry("a")]).hash == Catalogue.of([entry("a")]).hash


def test_control_messages_read_what_they_write() -> None:
    hello = Hello(software="test/1", boot_id="b", extensions={"catalogue": 1})
    assert parse_control(hello.to_text()) == hello
    assert parse_control('{"type":"future"}') is None


def test_a_control_message_without_anything_to_say_may_leave_its_data_out() -> None:
    assert parse_control('{"type":"lease.keep"}') == parse_control('{"type":"lease.keep","data":null}')
    assert parse_control('{"type":"lease.keep"}') is not None


@pytest.mark.parametrize("data", ["[]", "0", '""', "false"])
def test_data_that_is_no_object_is_a_wire_error_even_where_nothing_is_needed(data: str) -> None:
    with pytest.raises(WireError):
        parse_control(f'{{"type":"lease.keep","data":{data}}}')


@pytest.mark.parametrize("text", ["", "[]", '{"type":5}', '{"type":"ping","data":{}}', '{"type":"ping","data":[1]}'])
def test_bad_control_messages_are_wire_errors(text: str) -> None:
    with pytest.raises(WireError):
        parse_control(text)


def test_every_control_message_has_its_own_word() -> None:
    assert len({message.type for message in CONTROL_MESSAGES.values()}) == len(CONTROL_MESSAGES)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), [1, float("-inf")]])
def test_json_knows_no_nan(value: object) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_json(value)
