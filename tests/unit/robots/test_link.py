"""The line itself: who gets which acknowledgement, and what ends a wait."""

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kempelen.core.errors import AlarmError, KempelenError, LinkError, StoppedError
from kempelen.robots.grbl.codec import Event
from kempelen.robots.grbl.link import Link, RefusedError, SilenceError
from kempelen.robots.grbl.stream import Stream
from kempelen.testing.transports import memory_pair
from kempelen.testing.wires import ScriptedWire


async def linked(wire: ScriptedWire) -> Link:
    link = Link(wire.transport, lambda _event: None, lambda _error: None)
    link.start()
    return link


async def turns(count: int = 20) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


async def test_replies_come_with_their_acknowledgement() -> None:
    wire = ScriptedWire().expect(b"$G\n", b"[GC:G0 M9]\r\nok\r\n")
    link = await linked(wire)
    assert len(await link.request("$G")) == 1
    await link.close()


async def test_two_streams_do_not_mix() -> None:
    link = await linked(ScriptedWire().expect(b"X1\n"))
    first = asyncio.create_task(link.request("X1"))
    await turns()
    with pytest.raises(RuntimeError):
        await link.request("X2")
    await link.close()
    with pytest.raises(LinkError):
        await first


async def test_late_acknowledgements_belong_to_dead_lines() -> None:
    """A stream that failed leaves lines in flight; their answers are not the next stream's."""
    wire = ScriptedWire().expect(b"X1\nX2\nX3\n", b"error:24\r\n").expect(b"X4\n", b"ok\r\nerror:9\r\n")
    link = await linked(wire)
    with pytest.raises(RefusedError) as refused:
        await link.stream(Stream((b"X1\n", b"X2\n", b"X3\n")))
    assert refused.value.code == 24
    late = asyncio.create_task(link.request("X4"))
    await turns()
    assert not late.done()
    wire.say(b"ok\r\n")
    await late
    assert link.damaged == 0
    await link.close()
    wire.assert_done()


async def test_a_restart_voids_them() -> None:
    wire = (
        ScriptedWire()
        .expect(b"X1\nX2\n", b"error:24\r\nGrbl 1.1h ['$' for help]\r\n")
        .expect(b"X3\n", b"ok\r\n")
    )
    link = await linked(wire)
    with pytest.raises(RefusedError):
        await link.stream(Stream((b"X1\n", b"X2\n")))
    await link.request("X3")
    await link.close()


async def test_nothing_more_goes_out_after_a_failure() -> None:
    lines = tuple(f"X{n}.000Y{n}.000Z{n}.000\n".encode() for n in range(100, 130))
    wire = ScriptedWire().expect(b"".join(lines[:4]), b"ok\r\n").expect(lines[4], b"ALARM:1\r\nok\r\nok\r\n")
    link = await linked(wire)
    stream = Stream(lines)
    with pytest.raises(AlarmError):
        await link.stream(stream)
    await turns()
    assert stream.acknowledged == 3
    await link.close()
    wire.assert_done()


async def test_a_cancelled_caller_sends_nothing_more() -> None:
    lines = tuple(f"X{n}.000Y{n}.000Z{n}.000\n".encode() for n in range(100, 130))
    wire = ScriptedWire().expect(b"".join(lines[:4]))
    link = await linked(wire)
    running = asyncio.create_task(link.stream(Stream(lines)))
    await turns()
    running.cancel()
    await turns()
    wire.say(b"ok\r\n" * 4)
    await turns()
    assert running.cancelled()
    await link.close()
    wire.assert_done()


async def test_an_empty_stream_is_done() -> None:
    link = await linked(ScriptedWire())
    await link.stream(Stream(()))
    await link.close()


async def test_a_lost_line_ends_every_wait_and_every_later_call() -> None:
    losses: list[LinkError] = []
    wire = ScriptedWire().expect(b"X1\n").expect(b"?")
    link = Link(wire.transport, lambda _event: None, losses.append)
    link.start()
    waits = [asyncio.create_task(link.request("X1")), asyncio.create_task(link.ask(9.0))]
    await turns()
    wire.transport.lose()
    for wait in waits:
        with pytest.raises(LinkError, match="cable"):
            await wait
    assert len(losses) == 1
    for call in (link.request("X2"), link.ask(9.0), link.until(lambda: True, 9.0, "anything")):
        with pytest.raises(LinkError, match="cable"):
            await call
    await link.close()


async def test_a_write_that_fails_loses_the_line() -> None:
    wire = ScriptedWire()
    link = await linked(wire)

    def refuse(_data: bytes) -> None:
        raise LinkError("The connection is lost: no such device.")

    wire.transport.deliver = refuse
    with pytest.raises(LinkError, match="no such device"):
        link.realtime(b"!")
    assert link.lost is not None
    await link.close()


async def test_an_interruption_ends_stream_and_waits() -> None:
    link = await linked(ScriptedWire().expect(b"X1\n").expect(b"?"))
    waits = [asyncio.create_task(link.request("X1")), asyncio.create_task(link.ask(9.0))]
    await turns()
    link.interrupt(StoppedError("stopped"))
    for wait in waits:
        with pytest.raises(StoppedError):
            await wait
    await link.close()


async def test_an_alarm_answers_a_question() -> None:
    link = await linked(ScriptedWire().expect(b"?", b"ALARM:1\r\n"))
    with pytest.raises(AlarmError):
        await link.ask(9.0)
    await link.close()


async def test_a_question_swallowed_by_a_restart_is_asked_again() -> None:
    wire = ScriptedWire().expect(b"?", b"Grbl 1.1h ['$' for help]\r\n")
    wire.expect(b"?", b"<Alarm|MPos:0.000,0.000,0.000|FS:0,0>\r\n")
    link = await linked(wire)
    assert (await link.ask(9.0)).state == "Alarm"
    await link.close()
    wire.assert_done()


async def test_silence_has_an_end() -> None:
    link = await linked(ScriptedWire().expect(b"?"))
    with pytest.raises(SilenceError, match=r"no answer to a status query within 0.01 s"):
        await link.ask(0.01)
    await link.close()


async def test_a_line_that_is_closed_at_our_end() -> None:
    near, far = memory_pair()
    link = Link(near, lambda _event: None, lambda _error: None)
    link.start()
    near.write(b"?")
    assert await far.read() == b"?"
    await link.close()
    assert link.lost is not None


@settings(max_examples=60)
@given(st.lists(st.one_of(st.just(b"ok\r\n"), st.binary(max_size=12)), max_size=12), st.integers(1, 8))
def test_noise_never_completes_a_stream_early(pieces: list[bytes], count: int) -> None:
    """Not more lines are taken for acknowledged than there were whole, undamaged oks."""
    data = b"".join(pieces)
    true = sum(line.removesuffix(b"\r") == b"ok" for line in data.split(b"\n")[:-1])
    refusals = data.count(b"error:")

    async def play() -> Stream:
        wire = ScriptedWire()
        heard: list[Event] = []
        wire.transport.deliver = lambda _data: None
        link = Link(wire.transport, heard.append, lambda _error: None)
        link.start()
        stream = Stream(tuple(b"X1\n" for _ in range(count)))
        running = asyncio.create_task(link.stream(stream))
        await turns(3)
        for piece in pieces:
            wire.say(piece)
            await turns(3)
        await link.close()
        try:
            await running
        except KempelenError:
            assert true < count or refusals or b"ALARM" in data or b"Grbl" in data
        else:
            assert true >= count
        return stream

    stream = asyncio.run(play())
    assert stream.acknowledged <= true + refusals
