"""An answerer that is loaded with the first operator: whoever comes meanwhile loses nothing."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.adapters.peers.later_answerer import LaterAnswerer, LaterAnswererFactory
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import IceCandidate

CANDIDATE = IceCandidate(candidate="candidate:1", sdp_mid="0", sdp_m_line_index=0)


class Real:
    """What is loaded; it keeps what it was given."""

    def __init__(self) -> None:
        self.candidates: list[IceCandidate] = []
        self.offers: list[str] = []
        self.is_closed = False

    async def answer(self, offer_sdp: str, *_: Any) -> str:
        self.offers.append(offer_sdp)
        return f"answer to {offer_sdp}"

    async def add_candidate(self, candidate: IceCandidate) -> None:
        self.candidates.append(candidate)

    def path(self) -> str:
        return "path"

    async def close(self) -> None:
        self.is_closed = True


class Loading:
    """Takes until :attr:`may_end` is set, on whatever thread it is called."""

    def __init__(self) -> None:
        self.began, self.may_end = threading.Event(), threading.Event()
        self.threads: list[threading.Thread] = []
        self.made: list[Real] = []

    def __call__(self) -> Any:
        self.threads.append(threading.current_thread())
        self.began.set()
        assert self.may_end.wait(10)
        return self._make

    def _make(self, *_: Any) -> Real:
        self.made.append(Real())
        return self.made[-1]


@asynccontextmanager
async def over() -> AsyncIterator[Any]:
    loading = Loading()
    try:
        yield loading, LaterAnswererFactory(loading)
    finally:
        loading.may_end.set()


def answerer_of(factory: LaterAnswererFactory) -> Any:
    return factory(None, ())  # type: ignore[arg-type]


async def test_the_event_loop_goes_on_while_it_is_loaded_and_early_candidates_are_kept() -> None:
    async with over() as (loading, factory):
        answerer = answerer_of(factory)
        assert isinstance(answerer, LaterAnswerer)
        answering = asyncio.create_task(answerer.answer("offer", [], None))
        await asyncio.to_thread(loading.began.wait, 10)
        assert loading.threads != [threading.current_thread()]
        await answerer.add_candidate(CANDIDATE)
        assert answerer.path() is None
        loading.may_end.set()
        assert await answering == "answer to offer"
        (real,) = loading.made
        assert real.candidates == [CANDIDATE]
        assert answerer.path() == "path"
        await answerer.add_candidate(CANDIDATE)
        assert await answerer.answer("further", [], None) == "answer to further"
        await answerer.close()
        assert (real.candidates, real.is_closed) == ([CANDIDATE] * 2, True)


async def test_it_is_loaded_once_and_who_comes_later_gets_the_real_one() -> None:
    async with over() as (loading, factory):
        loading.may_end.set()
        await answerer_of(factory).answer("offer", [], None)
        assert isinstance(answerer_of(factory), Real)
        assert len(loading.threads) == 1


async def test_who_leaves_meanwhile_is_not_answered() -> None:
    async with over() as (loading, factory):
        answerer = answerer_of(factory)
        answering = asyncio.create_task(answerer.answer("offer", [], None))
        await asyncio.to_thread(loading.began.wait, 10)
        await answerer.close()
        loading.may_end.set()
        with pytest.raises(ConnectionFailed, match="closed"):
            await answering
        assert not loading.made
