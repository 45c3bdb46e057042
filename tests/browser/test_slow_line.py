"""The line that `make page-speed` measures over: how long bytes take, in closed form, and that all of them arrive."""

import asyncio

import pytest

from tests.browser.slow_line import CHUNK, Line, slow_line

RATE, DELAY = 2.5e6, 0.025


def test_a_chunk_takes_its_size_by_the_rate_and_the_delay():
    assert Line(RATE, DELAY).arrival(3.0, 50_000) == pytest.approx(3.0 + 0.02 + 0.025)


def test_chunks_one_behind_the_other_come_at_the_rate_of_the_line():
    """n chunks of b bytes that are there at once: the last one arrives after n b / rate + delay, the delay once."""
    line = Line(RATE, DELAY)
    arrivals = [line.arrival(0.0, CHUNK) for _ in range(100)]
    assert arrivals == pytest.approx([(k + 1) * CHUNK / RATE + DELAY for k in range(100)])


def test_a_line_that_was_idle_owes_nothing():
    line = Line(RATE, DELAY)
    line.arrival(0.0, CHUNK)
    assert line.arrival(10.0, CHUNK) == pytest.approx(10.0 + CHUNK / RATE + DELAY)


def test_bytes_pass_unchanged_and_no_sooner_than_the_line_allows():
    """There and back through a server that gives back what it got; a busy machine may only take longer."""
    sent, rate, round_trip = bytes(range(256)) * 1024, 4e6, 0.1

    async def echo(reader, writer):
        writer.write(await reader.readexactly(len(sent)))
        writer.close()

    async def through():
        clock = asyncio.get_running_loop().time
        server = await asyncio.start_server(echo, "127.0.0.1", 0)
        async with server, slow_line(server.sockets[0].getsockname()[1], rate, round_trip) as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            began = clock()
            writer.write(sent)
            back = await reader.read(-1)
            took = clock() - began
            writer.close()
        return back, took

    back, took = asyncio.run(through())
    assert back == sent
    # The clock of the loop is not finer than a millisecond.
    assert took >= 2 * len(sent) / rate + round_trip - 1e-3
