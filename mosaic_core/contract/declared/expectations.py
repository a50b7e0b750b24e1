"""Tells what a configuration or a message should say where pydantic refused what it says, in words of ours."""

from __future__ import annotations

import re

from pydantic_core import ErrorDetails

from mosaic_core.words.errors import guess
from mosaic_core.words.safety_config import FIELD_PATH

_QUOTED = re.compile(r"'([^']*)'")
_TRUTH = re.compile(r"\b(True|False)\b")
EXPLAINED = ("value_error", "assertion_error")
"""A validator's own words, which name the value themselves."""
_PATTERNS = {  # by key, or by the pattern itself where plugins may have keys of that name
    "label": "letters, digits and _.:/- (at most 64, a letter or digit first; names starting with '_' are reserved)",
    "ws_url": "a URL without a path such as wss://mosaic.example.org",
    r"^[a-z][a-z0-9_-]{0,31}$": "a name of small letters, digits, - and _ (at most 32, a letter first) such as arm",
    FIELD_PATH: "the dotted path of a number in the message, such as linear.x",
}
_WEB_SCHEME = re.compile(r"https?://", re.IGNORECASE)
_EXPECTED = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "text",
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
    "model_attributes_type": "a mapping of keys to values",
    "tuple_type": "a list",
    "list_type": "a list",
    "uuid_parsing": "a UUID such as 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11",
    "uuid_type": "a UUID such as 7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11",
    "greater_than": "a number > {gt}",
    "greater_than_equal": "a number ≥ {ge}",
    "less_than": "a number < {lt}",
    "less_than_equal": "a number ≤ {le}",
    "multiple_of": "a multiple of {multiple_of}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
    "time_delta_type": "a duration such as 00:00:30",
    "time_delta_parsing": "a duration such as 00:00:30",
    "datetime_type": "a date and time such as 2026-01-31T12:00:00Z",
    "datetime_parsing": "a date and time such as 2026-01-31T12:00:00Z",
    "datetime_from_date_parsing": "a date and time such as 2026-01-31T12:00:00Z",
    "date_type": "a date such as 2026-01-31",
    "date_parsing": "a date such as 2026-01-31",
    "date_from_datetime_parsing": "a date such as 2026-01-31",
    "path_type": "a path",
    "bytes_type": "text",
    "set_type": "a list",
    "frozen_set_type": "a list",
    "url_parsing": "a URL such as https://example.org",
    "url_scheme": "a URL that begins with {expected_schemes}",
    "ip_any_address": "an IP address such as 192.168.0.1",
    "pattern_regex": "a regular expression",
    "string_pattern_mismatch": "text that matches {pattern}",
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
}


def expectation(mistake: ErrorDetails, key: str, also: str = "") -> tuple[str, str]:
    """What was expected at ``key``, and the known word that was probably meant. ``also``: what else may stand there."""
    kind = mistake["type"]
    context = {name: f"{one:g}" if isinstance(one, float) else one for name, one in mistake.get("ctx", {}).items()}
    if kind in ("literal_error", "enum"):
        return _of(_TRUTH.sub(lambda one: one[0].lower(), str(context.get("expected"))), also, mistake)
    web_scheme = _WEB_SCHEME.match(str(mistake["input"]))
    if kind == "string_pattern_mismatch" and key == "ws_url" and web_scheme:
        written = web_scheme[0].lower()
        cure = f"write {written.replace('http', 'ws')} instead of {written}"
        return "expected a URL that begins with ws:// or wss://", cure
    for known_as in (key, str(context.get("pattern"))):
        if kind == "string_pattern_mismatch" and known_as in _PATTERNS:
            return f"expected {_PATTERNS[known_as]}", ""
    if kind in EXPLAINED:
        return str(context.get("error", mistake["msg"])), ""
    if kind in _EXPECTED:
        return _of(_EXPECTED[kind].format(**context), also, mistake)
    said = mistake["msg"].partition(" should be ")[2]
    return f"expected {said}" if said else mistake["msg"], ""


def _of(words: str, also: str, mistake: ErrorDetails) -> tuple[str, str]:
    either = f"{words} or {also}" if also else words
    return f"expected {either}", guess(str(mistake["input"]), _QUOTED.findall(either))
