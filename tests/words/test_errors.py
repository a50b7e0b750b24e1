"""Sentences of errors: where one ends, and which name may have been meant."""

from __future__ import annotations

import pytest

from mosaic_core.words.errors import Problem, Refused, by_line, hint_at, whole_sentence


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("no field 'linera'", "no field 'linera'."),
        ("It is no JSON.", "It is no JSON."),
        ("did you mean 'linear'?", "did you mean 'linear'?"),
        ("and so on …", "and so on …"),
        ("Stop!", "Stop!"),
        ("these are known:", "these are known:"),
    ],
)
def test_a_sentence_ends_once(text: str, whole: str) -> None:
    assert whole_sentence(text) == whole


@pytest.mark.parametrize("name", ["rovr", "zeppelin"])
def test_a_hint_ends_the_sentence_before_it(name: str) -> None:
    sentence = f"no robot {name!r}{hint_at(name, ['rover'])}"
    assert whole_sentence(sentence) == sentence


@pytest.mark.parametrize("code", ["not to thirteen", "", "arm.is moving"])
def test_a_refusal_needs_a_code_before_its_text(code: str) -> None:
    with pytest.raises(ValueError, match=r"Refused\('acme\.why', "):
        Refused(code)
    assert [Refused(one, code).code for one in ("acme-arm.in_the_way", "busy")] == ["acme-arm.in_the_way", "busy"]


def test_problems_stand_in_the_order_of_the_file_and_those_of_code_in_that_of_the_connectors() -> None:
    of_file = [Problem("", file="robot.yaml", line=line, path=path) for line, path in ((4, "server"), (30, "x"))]
    of_code = [
        Problem("", file=file, line=line, path=f"connectors[{index}]")
        for index, file, line in ((0, "b.py", 90), (2, "a.py", 3), (12, "c.py", 1))
    ]
    assert by_line([*of_code[::-1], *of_file[::-1]]) == (*of_file, *of_code)
