"""What becomes of several films on one link that is narrower than their sum: cameras of one robot, viewers of one
camera, and traffic of others. Played without a network, see ``link_film.py``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest
from link_film import FPS, Film, profile

from mosaic_core.machines.laboratory.impaired_link import LinkProfile

SETTLE_S = 10.0


def cameras(count: int, rate_mbps: float, seed: int, *, loss: float = 0.0, shares: bool = False) -> list[Film]:
    """Their pictures are taken one camera after the other. ``shares``: they have one budget."""
    films = [Film(profile(rate_mbps, loss), 10 * seed)]
    for number in range(1, count):
        films.append(Film(films[0].link_profile, 10 * seed + number, films[0], number / count / FPS, shares))
    return films


def foreign(film: Film, rate_mbps: float, until_s: float) -> None:
    """Packets of somebody who makes way for nobody."""
    if film.now_s < until_s:
        film.over(film.link, 1200, lambda: None)
        film.at(film.now_s + 1200 * 8 / (rate_mbps * 1e6), lambda: foreign(film, rate_mbps, until_s))


def cuts_per_min(film: Film, from_s: float) -> float:
    rates = [bps for at_s, bps in film.rates if at_s >= from_s]
    return sum(late < 0.93 * early for early, late in itertools.pairwise(rates)) * 60 / (film.now_s - from_s)


def mean_bps(film: Film, from_s: float) -> float:
    rates = [bps for at_s, bps in film.rates if at_s >= from_s]
    return sum(rates) / len(rates)


def unfairness(films: Sequence[Film], from_s: float) -> float:
    means = [mean_bps(film, from_s) for film in films]
    return max(means) / min(means)


@pytest.mark.parametrize(("count", "rate_mbps"), [(2, 3), (2, 2), (3, 4), (4, 4)])
@pytest.mark.parametrize(("seed", "shares"), [(1, False), (2, False), (1, True)])
def test_cameras_that_fill_a_link_settle_and_share_it(count: int, rate_mbps: float, seed: int, shares: bool) -> None:
    films = cameras(count, rate_mbps, seed, shares=shares)
    films[0].play(SETTLE_S + 60)
    for film in films:
        ages_ms = film.ages_ms(SETTLE_S)
        assert film.freezes(SETTLE_S) == 0
        assert ages_ms[len(ages_ms) // 2] < 60
        assert film.p95_ms(SETTLE_S) < 130
        assert len(ages_ms) > 29 * 60
        assert cuts_per_min(film, SETTLE_S) <= 12
    assert sum(mean_bps(film, SETTLE_S) for film in films) > 0.75e6 * rate_mbps
    assert unfairness(films, SETTLE_S + 20) < 2.25


@pytest.mark.parametrize("seed", range(1, 4))
def test_who_comes_late_gets_a_fair_share_of_a_full_link(seed: int) -> None:
    first = Film(profile(2), 10 * seed).play(15)
    late = Film(first.link_profile, 10 * seed + 1, first, later_s=1 / 60)
    first.play(90)
    assert unfairness([first, late], first.now_s - 40) < 2.25
    assert max(film.p95_ms(first.now_s - 75) for film in (first, late)) < 130


@pytest.mark.parametrize("seed", range(1, 4))
def test_what_a_camera_that_is_not_watched_any_more_leaves_is_used_within_half_a_minute(seed: int) -> None:
    films = cameras(3, 4, seed)
    films[0].play(40)
    films[2].look_away()
    since_s = films[0].now_s
    films[0].play(35)
    assert sum(film.part_bps for film in films[:2]) > 3_000_000
    assert unfairness(films[:2], since_s) < 2
    films[2].look()
    films[0].play(40)
    back_s = films[0].now_s - 30
    assert unfairness(films, back_s) < 2
    for film in films:
        assert film.freezes(back_s) == 0
        assert film.p95_ms(back_s) < 130


@pytest.mark.parametrize(("rate_mbps", "foreign_mbps"), [(4, 3), (3, 2), (2, 1)])
@pytest.mark.parametrize("seed", range(1, 3))
def test_beside_traffic_that_makes_way_for_nobody_pictures_stay_young(
    rate_mbps: float, foreign_mbps: float, seed: int
) -> None:
    film = Film(profile(rate_mbps), seed).play(2)
    foreign(film, foreign_mbps, until_s=SETTLE_S + 60)
    film.play(SETTLE_S + 58)
    ages_ms = film.ages_ms(SETTLE_S)
    assert film.freezes(SETTLE_S) <= 1
    assert ages_ms[len(ages_ms) // 2] < 80
    assert film.p95_ms(SETTLE_S) < 220
    assert mean_bps(film, SETTLE_S) > 0.7e6 * (rate_mbps - foreign_mbps)
    since_s = film.now_s
    film.play(35)
    assert film.part_bps > 0.75 * min(1e6 * rate_mbps, film.rungs[0].ceiling_bps)
    assert film.freezes(since_s) == 0


class Download:
    """One TCP connection that takes all that it gets, with CUBIC's window (RFC 9438): it fills the queue until packets
    are lost, and goes back to seven tenths."""

    def __init__(self, film: Film) -> None:
        self.film, self.window, self.on_the_way, self.arrived_bytes = film, 10.0, 0, 0
        self.most, self.is_starting, self.cut_at_s = 10.0, True, 0.0
        self.is_over = False
        self.send()

    def send(self) -> None:
        film = self.film
        while self.on_the_way < self.window and not self.is_over:
            self.on_the_way += 1
            arrival_s = film.link.arrival_s(1500, film.now_s, film.chance.random(), 0.0, 1.0)
            if arrival_s is None:
                film.at(film.now_s + film.link.profile.queue_ms / 1e3, self.lost)
            else:
                film.at(arrival_s + film.link.profile.delay_ms / 1e3, self.acknowledged)

    def acknowledged(self) -> None:
        self.on_the_way -= 1
        self.arrived_bytes += 1500
        if self.is_starting:
            self.window += 1.0
        else:
            aim = self.most + 0.4 * (self.film.now_s - self.cut_at_s - (0.75 * self.most) ** (1 / 3)) ** 3
            self.window += min(0.5, max(0.0, aim - self.window) / self.window)
        self.send()

    def lost(self) -> None:
        self.on_the_way -= 1
        if self.film.now_s - self.cut_at_s > self.film.link.profile.queue_ms / 1e3:
            self.most, self.is_starting, self.cut_at_s = self.window, False, self.film.now_s
            self.window *= 0.7
        self.send()


@pytest.mark.parametrize(("rate_mbps", "seed"), [(1, 1), (1, 2), (3, 1), (3, 2)])
def test_beside_a_download_pictures_keep_a_share_until_it_ends(rate_mbps: float, seed: int) -> None:
    film = Film(LinkProfile("uplink", delay_ms=5, rate_mbps=rate_mbps, queue_ms=300), seed).play(SETTLE_S)
    download = Download(film)
    film.play(20)
    began_s, before_bytes = film.now_s, film.sent_bytes
    film.play(90)
    ages_ms = film.ages_ms(began_s)
    assert (film.sent_bytes - before_bytes) * 8 / 90 > 0.25e6 * rate_mbps
    assert ages_ms[len(ages_ms) // 2] < 280
    download.is_over = True
    since_s = film.now_s
    film.play(40)
    assert film.p95_ms(since_s + 10) < 100
    assert film.part_bps > 0.6 * min(1e6 * rate_mbps, film.rungs[0].ceiling_bps)


class Transfer:
    """Bulk data of the same robot for the same operator, as fast as it may be sent."""

    def __init__(self, film: Film) -> None:
        self.film, self.arrived_bytes = film, 0
        self.send()

    def send(self) -> None:
        film = self.film
        rate, now_s = film.budget.background, film.now_s
        wait_s = rate.wait_s(now_s)
        if wait_s == 0.0:
            size_bytes = round(rate.burst_bytes)
            rate.sent(size_bytes, now_s)
            film.over(film.link, size_bytes, lambda: self.arrived(size_bytes))
        film.at(now_s + max(1e-3, wait_s), self.send)

    def arrived(self, size_bytes: int) -> None:
        self.arrived_bytes += size_bytes


@pytest.mark.parametrize("rate_mbps", [1, 3, 10])
@pytest.mark.parametrize("seed", range(1, 3))
def test_a_bulk_transfer_takes_what_pictures_leave_and_costs_them_no_more_than_20_ms(
    rate_mbps: float, seed: int
) -> None:
    alone = Film(profile(rate_mbps), seed).play(SETTLE_S + 60)
    film = Film(profile(rate_mbps), seed).play(SETTLE_S - 5)
    transfer = Transfer(film)
    film.play(5)
    before_bytes = transfer.arrived_bytes
    film.play(60)
    assert film.freezes(SETTLE_S) <= alone.freezes(SETTLE_S)
    assert film.p95_ms(SETTLE_S) < alone.p95_ms(SETTLE_S) + 20
    assert mean_bps(film, SETTLE_S) > 0.8 * mean_bps(alone, SETTLE_S)
    left_bps = 1e6 * rate_mbps - mean_bps(film, SETTLE_S)
    assert (transfer.arrived_bytes - before_bytes) * 8 / 60 > 0.4 * left_bps


def sensor(film: Film, bps: float, every_s: float, until_s: float) -> None:
    """Ordinary data of the same robot for the same operator."""
    left_bytes = round(bps / 8 * every_s)
    while left_bytes > 0:
        size_bytes = min(1200, left_bytes)
        left_bytes -= size_bytes
        film.budget.data_left(size_bytes, film.now_s)
        film.over(film.link, size_bytes, lambda: None)
    if film.now_s < until_s:
        film.at(film.now_s + every_s, lambda: sensor(film, bps, every_s, until_s))


@pytest.mark.parametrize(
    ("rate_mbps", "every_s", "p95_ms"), [(1, 0.02, 75), (1, 0.2, 120), (3, 0.02, 65), (3, 0.2, 110)]
)
@pytest.mark.parametrize("seed", range(1, 3))
def test_beside_a_sensor_that_takes_three_tenths_of_the_link_no_picture_stands(
    rate_mbps: float, every_s: float, p95_ms: float, seed: int
) -> None:
    film = Film(profile(rate_mbps), seed).play(SETTLE_S)
    sensor(film, 0.3e6 * rate_mbps, every_s, SETTLE_S + 60)
    film.play(60)
    assert film.freezes(SETTLE_S) == 0
    assert film.p95_ms(SETTLE_S + 5) < p95_ms
    assert mean_bps(film, SETTLE_S + 5) > 0.45e6 * rate_mbps
    since_s = film.now_s + 5
    film.play(25)
    assert mean_bps(film, since_s) > 0.7e6 * rate_mbps


class Viewer(Film):
    """Of a camera with others: a rung is encoded once, for the slowest of those who watch it."""

    others: Sequence[Viewer] = ()

    @property
    def encoder_bps(self) -> int:
        return min(viewer.picture_bps for viewer in (self, *self.others) if viewer.choice.index == self.choice.index)


@pytest.mark.parametrize("seed", range(1, 4))
def test_two_viewers_of_one_camera_behind_one_uplink_settle(seed: int) -> None:
    viewers = [Viewer(profile(3), 10 * seed)]
    viewers.append(Viewer(viewers[0].link_profile, 10 * seed + 1, viewers[0]))
    viewers[0].others = viewers[1].others = viewers
    viewers[0].play(SETTLE_S + 60)
    for viewer in viewers:
        assert viewer.freezes(SETTLE_S) == 0
        assert viewer.p95_ms(SETTLE_S) < 130
        assert cuts_per_min(viewer, SETTLE_S) < 10
    assert unfairness(viewers, SETTLE_S + 20) < 2


@pytest.mark.parametrize("seed", range(1, 4))
def test_on_a_shared_link_that_loses_packets_copies_do_not_crowd_each_other_out(seed: int) -> None:
    films = cameras(2, 3, seed, loss=0.03)
    films[0].play(SETTLE_S + 60)
    for film in films:
        assert film.freezes(SETTLE_S) <= 3
        assert film.p95_ms(SETTLE_S) < 150
        assert film.part_bps > 400_000


@pytest.mark.parametrize("seed", range(1, 3))
def test_a_path_of_our_own_that_narrows_for_a_while_is_not_taken_for_a_shared_one(seed: int) -> None:
    film = Film(profile(4), seed).play(SETTLE_S)
    film.become(profile(1))
    film.play(10)
    film.become(profile(4))
    since_s = film.now_s
    film.play(10)
    assert next(at_s for at_s, bps in film.rates if at_s > since_s and bps > 1_500_000) - since_s < 5
    assert film.freezes(since_s) == 0


@pytest.mark.parametrize("seed", range(1, 3))
def test_a_shared_link_that_narrows_and_widens_is_followed(seed: int) -> None:
    films = cameras(2, 4, seed)
    films[0].play(SETTLE_S)
    films[0].become(profile(1))
    films[0].play(20)
    narrow_s = films[0].now_s - 12
    assert max(film.p95_ms(narrow_s) for film in films) < 200
    films[0].become(profile(4))
    films[0].play(40)
    wide_s = films[0].now_s - 10
    assert sum(mean_bps(film, wide_s) for film in films) > 2_400_000
    assert max(film.p95_ms(wide_s) for film in films) < 130
