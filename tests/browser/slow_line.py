"""A slow line to the page, for measurements: a TCP proxy that delays what passes and lets only so much through."""

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass

CHUNK = 16_384
"""Bytes that are taken in at once; no more is read before the line has sent them, so nothing piles up here."""


@dataclass
class Line:
    """One direction: a chunk is sent behind the one before it, at ``rate`` [bytes/s], and comes ``delay`` [s] later."""

    rate: float
    delay: float
    free: float = 0.0
    """When all that was taken in has been sent [s]."""

    def arrival(self, now: float, size: int) -> float:
        """When a chunk of ``size`` bytes comes out that is taken in ``now`` [s]."""
        self.free = max(now, self.free) + size / self.rate
        return self.free + self.delay


async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, line: Line) -> None:
    """All that ``reader`` gives to ``writer`` over ``line``, to its end."""
    clock = asyncio.get_running_loop().time
    under_way: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

    async def deliver() -> None:
        while True:
            due, chunk = await under_way.get()
            await asyncio.sleep(due - clock())
            if not chunk:
                return
            writer.write(chunk)
            await writer.drain()

    async def take_in() -> None:
        while chunk := await reader.read(CHUNK):
            under_way.put_nowait((line.arrival(clock(), len(chunk)), chunk))
            await asyncio.sleep(line.free - clock())
        under_way.put_nowait((line.free + line.delay, b""))

    try:
        await asyncio.gather(deliver(), take_in())
    except ConnectionError:  # one of the ends is gone
        pass
    finally:
        writer.close()


@asynccontextmanager
async def slow_line(port: int, rate: float, round_trip: float):
    """Port of a line to ``port`` of this machine, for each connection ``rate`` [bytes/s] there and as much back.

    ``round_trip``: what it adds to that of the machine [s], half on the way there and half back.
    """

    carried: list[asyncio.Event] = []

    async def connect(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        carried.append(over := asyncio.Event())
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", port, limit=CHUNK)
        await asyncio.gather(
            carry(reader, inner_writer, Line(rate, round_trip / 2)),
            carry(inner_reader, writer, Line(rate, round_trip / 2)),
        )
        over.set()

    server = await asyncio.start_server(connect, "127.0.0.1", 0, limit=CHUNK)
    async with server:
        yield server.sockets[0].getsockname()[1]
        for over in carried:  # what its user has closed is over a delay later
            await asyncio.wait_for(over.wait(), 10.0)
