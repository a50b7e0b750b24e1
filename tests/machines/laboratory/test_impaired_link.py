from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.laboratory.impaired_link import PROFILES, ImpairedLink, LinkProfile

SHARES = st.floats(0, 1, exclude_max=True)


def run(link: ImpairedLink, count: int, *, gap_s: float = 0.001, size: int = 1000, seed: int = 1) -> list[float | None]:
    chance = random.Random(seed)
    return [
        link.arrival_s(size, at * gap_s, chance.random(), chance.uniform(-1, 1), chance.random()) for at in range(count)
    ]


def test_a_pristine_link_delivers_at_once() -> None:
    assert run(ImpairedLink(PROFILES["pristine"]), 3) == [0.0, 0.001, 0.002]


def test_the_delay_is_one_way_and_the_jitter_around_it() -> None:
    link = ImpairedLink(LinkProfile("x", delay_ms=50, jitter_ms=20, reorder=1.0))
    delays = [arrival - at * 0.001 for at, arrival in enumerate(run(link, 500)) if arrival is not None]
    assert len(delays) == 500
    assert min(delays) >= 0.03 - 1e-9
    assert max(delays) <= 0.07 + 1e-9
    assert max(delays) - min(delays) > 0.03


@pytest.mark.parametrize("loss", [0.0, 0.05, 0.5])
def test_the_share_of_losses_is_as_asked(loss: float) -> None:
    link = ImpairedLink(LinkProfile("x", loss=loss))
    lost = run(link, 4000).count(None)
    assert lost == link.lost
    assert lost / 4000 == pytest.approx(loss, abs=0.03)


def test_a_bottleneck_spaces_packets_and_drops_what_its_queue_cannot_hold() -> None:
    link = ImpairedLink(LinkProfile("x", rate_mbps=1, queue_ms=100))
    arrivals = run(link, 200, gap_s=0.0, size=1250)  # 10 ms each
    through = [arrival for arrival in arrivals if arrival is not None]
    assert through == pytest.approx([0.01 * number for number in range(1, len(through) + 1)])
    assert 10 <= len(through) <= 12
    assert link.lost == 200 - len(through)


def test_a_cut_link_loses_everything_until_it_heals() -> None:
    link = ImpairedLink(PROFILES["pristine"])
    link.is_cut = True
    assert run(link, 5) == [None] * 5
    link.is_cut = False
    assert None not in run(link, 5)


@given(
    delay=st.floats(0, 500), jitter=st.floats(0, 500), rate=st.none() | st.floats(0.1, 100), seed=st.integers(0, 2**32)
)
def test_packets_keep_their_order_unless_reordering_is_asked_for(
    delay: float, jitter: float, rate: float | None, seed: int
) -> None:
    link = ImpairedLink(LinkProfile("x", delay_ms=delay, jitter_ms=jitter, rate_mbps=rate, loss=0.1))
    arrivals = [arrival for arrival in run(link, 60, seed=seed) if arrival is not None]
    assert arrivals == sorted(arrivals)


def test_reordering_lets_packets_overtake() -> None:
    link = ImpairedLink(LinkProfile("x", delay_ms=50, jitter_ms=20, reorder=0.3))
    arrivals = [arrival for arrival in run(link, 300) if arrival is not None]
    assert arrivals != sorted(arrivals)


def test_profiles_are_those_of_the_page_about_bad_networks() -> None:
    page = (Path(__file__).parents[3] / "docs/howto/test-on-bad-networks.md").read_text()
    rows = re.findall(r"\| `(.+)` \| (.+) \| (.+) \| (.+) \|", page.partition("## ")[0])
    assert rows == [as_told(name, profile) for name, profile in PROFILES.items()]


def as_told(name: str, its: LinkProfile) -> tuple[str, str, str, str]:
    delay = f"{its.delay_ms} ± {its.jitter_ms} ms" if its.delay_ms else "nothing added"
    rate = "none" if its.rate_mbps is None else f"{its.rate_mbps} Mbit/s"
    return name, delay, f"{its.loss:.0%}".replace("%", " %") if its.loss else "none", rate


@given(at=st.floats(0, 1e6), chance=SHARES, deviation=st.floats(-1, 1), reorder=SHARES, size=st.integers(1, 65535))
def test_nothing_arrives_before_it_left(at: float, chance: float, deviation: float, reorder: float, size: int) -> None:
    for profile in PROFILES.values():
        arrival = ImpairedLink(profile).arrival_s(size, at, chance, deviation, reorder)
        assert arrival is None or arrival >= at
