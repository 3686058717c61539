"""Presses that wait: which of them are played, and how many may wait."""

from __future__ import annotations

import asyncio

import pytest

from chladni.host.studio.messages.guard import SentAwayError
from chladni.host.studio.messages.requests import Move, Place, Touch, Voice
from chladni.host.studio.playing.queue import MOST_WAITING, Queue


def taken(*requests: Touch | Voice | Move) -> list[int]:
    """Numbers of the requests that are played of those that came."""
    queue = Queue()
    for request in requests:
        queue.put(request)
    return [one.number for one in asyncio.run(queue.take())]


def touch(number: int, finger: int, place_mm: Place | None) -> Touch:
    return Touch(number, finger, place_mm)


def test_of_one_finger_or_part_that_moves_on_only_the_last_place_is_played() -> None:
    here, there = (1.0, 2.0), (3.0, 4.0)
    assert taken(touch(1, 0, here), touch(2, 0, there)) == [2]
    coil, screw = Move(1, "actuators", 0, here), Move(2, "screws", 0, here)
    assert taken(coil, Move(3, "actuators", 0, there)) == [3]
    voice = Voice(1, 0, 100.0, 1.0)
    assert taken(voice, Voice(2, 0, 101.0, 1.0)) == [2]
    assert taken(voice, Voice(2, 1, 101.0, 1.0), touch(3, 1, here)) == [1, 2, 3]
    # Another finger, another part, a lift and what follows it are all played.
    assert taken(touch(1, 0, here), touch(2, 1, there)) == [1, 2]
    assert taken(coil, screw) == [1, 2]
    assert taken(touch(1, 0, here), touch(2, 0, None), touch(3, 0, there)) == [1, 2, 3]


def test_a_page_that_lets_more_wait_than_it_may_is_sent_away() -> None:
    queue = Queue()
    for number in range(MOST_WAITING):
        queue.put(touch(number, number % 2, (0.0, 0.0)))
    with pytest.raises(SentAwayError, match="too many touches"):
        queue.put(touch(MOST_WAITING, MOST_WAITING % 2, (0.0, 0.0)))


def test_what_is_forgotten_is_not_waited_for() -> None:
    async def take_after_clear() -> list[Touch | Voice | Move]:
        queue = Queue()
        queue.put(touch(1, 0, (0.0, 0.0)))
        queue.clear()
        taking = asyncio.create_task(queue.take())
        await asyncio.sleep(0)
        assert not taking.done()
        queue.put(touch(2, 0, (0.0, 0.0)))
        return await taking

    assert [one.number for one in asyncio.run(take_after_clear())] == [2]
