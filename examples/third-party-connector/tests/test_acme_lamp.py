"""The lamp: obeys, and goes dark when nobody commands it any more."""

from __future__ import annotations

from pathlib import Path

import pytest
from acme_workbench.lamp import Lamp, LampConfigurer

from mosaic_core.testing import Leaves, MadeSafe, Silence, build, feed


@pytest.fixture
def led(tmp_path: Path) -> Path:
    (tmp_path / "max_brightness").write_text("200\n")
    (tmp_path / "brightness").write_text("0\n")
    return tmp_path


@pytest.fixture
def lamp(led: Path) -> Lamp:
    return build(LampConfigurer, params={"led": str(led)})


def test_it_shines_as_told(lamp: Lamp, led: Path) -> None:
    feed(lamp, [{"brightness_percent": 50}])
    assert (led / "brightness").read_text() == "100"


def test_it_goes_dark_when_the_operator_falls_silent(lamp: Lamp, led: Path) -> None:
    fed = feed(lamp, [{"brightness_percent": 100}, Silence(4), {"brightness_percent": 80}, Silence(60)])
    assert fed.made_safe == [MadeSafe(9.0, "safety.timeout")]
    assert (led / "brightness").read_text() == "0"


def test_it_goes_dark_when_the_operator_leaves(lamp: Lamp, led: Path) -> None:
    fed = feed(lamp, [{"brightness_percent": 100}, Leaves()])
    assert fed.made_safe == [MadeSafe(0.0, "safety.peer_left")]
    assert (led / "brightness").read_text() == "0"


def test_what_is_no_brightness_never_reaches_it(lamp: Lamp, led: Path) -> None:
    fed = feed(lamp, [{"brightness_percent": 101}, {"brightness": 50}, "{"])
    assert [refused.code for refused in fed.refused] == ["channel.invalid"] * 3
    assert (led / "brightness").read_text() == "0\n"
