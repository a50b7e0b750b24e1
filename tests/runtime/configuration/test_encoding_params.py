"""What a file says of encoding reaches the camera or the microphone, or is refused before anything starts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from support.refused_start import problems_at_start

from mosaic_core import AudioTrackHandler, EncodingParams, Handler, MediaTrackConfigurer, MediaTrackHandler, NoParams
from mosaic_core.contract.sound import SoundEncoding
from mosaic_core.testing import connector, joined


class Eye(MediaTrackHandler):
    """Takes nothing of its params."""


class Lens(MediaTrackHandler):
    def __init__(self, label: str, params: EncodingParams) -> None:
        super().__init__(label)
        self.encoding = params


class Ear(AudioTrackHandler):
    """Takes nothing of its params."""


class OfTheClass(MediaTrackHandler):
    encoding = EncodingParams(codec="vp8")


def configurer_of(kind: Any, make: Any) -> Any:
    class OneConfigurer(MediaTrackConfigurer[kind]):  # type: ignore[valid-type]
        connector_type = "one"

        def configure(self) -> Sequence[Handler]:
            return make(self.label, self.params)  # type: ignore[no-any-return]

    return OneConfigurer


@pytest.mark.parametrize(
    ("params", "handler"), [(EncodingParams, Eye), (SoundEncoding, Ear)], ids=["camera", "microphone"]
)
def test_params_of_encoding_that_nobody_takes_are_told_with_the_line_of_the_class(params: Any, handler: Any) -> None:
    (problem,) = problems_at_start(configurer_of(params, lambda label, its: [handler(label)]), label="front")
    assert f"{handler.__name__} takes nothing of what its params say of encoding" in problem.message
    assert problem.cure == f"write self.encoding = params in {handler.__name__}.__init__"
    assert problem.file == __file__


@pytest.mark.parametrize(
    ("params", "make"),
    [
        (EncodingParams, lambda label, its: [Lens(label, its)]),
        (EncodingParams, lambda label, its: [Lens(label, its), Eye(f"{label}_2")]),
        (EncodingParams, lambda label, its: [OfTheClass(label)]),
        (NoParams, lambda label, its: [Eye(label)]),
    ],
    ids=["takes them", "one of two does", "the class decides", "has none"],
)
async def test_whoever_takes_them_or_has_none_is_fine(params: Any, make: Any) -> None:
    async with joined(connector(configurer_of(params, make), label="front")) as link:
        assert link.robot is not None
