"""The latch bridge's own C++, compiled for this machine, against the virtual bridge's clock of steps."""

import random
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from kempelen.robots.arm.latch.codec import framed
from kempelen.twin.latch.bridge import PHASES
from kempelen.twin.latch.steps import QUEUE, Block, StepClock

SOURCE = Path(__file__).parents[3] / "firmware" / "latch-bridge"
COMPILER = next(filter(None, map(shutil.which, ("g++", "clang++", "c++"))), None)
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler (g++, clang++, c++) is installed")
MOTORS = 5


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("firmware") / "steps"
    flags = ["-std=c++11", "-Wall", "-Wextra", "-Werror", "-O1"]
    subprocess.run([str(COMPILER), *flags, "-o", out, SOURCE / "host.cpp"], check=True, capture_output=True)
    return out


def run(firmware: Path, script: Sequence[str]) -> list[str]:
    told = subprocess.run([firmware], input="\n".join(script), check=True, capture_output=True, text=True)
    return told.stdout.splitlines()


class Both:
    """A script for the firmware, and what the virtual clock makes of it."""

    def __init__(self) -> None:
        self.clock = StepClock(MOTORS)
        self.script: list[str] = []
        self.expected: list[str] = []

    def push(self, milliseconds: int, steps: Sequence[int]) -> None:
        self.script.append(f"push {milliseconds} {' '.join(map(str, steps))}")
        self.expected.append("full" if self.clock.full else "pushed")
        if not self.clock.full:
            self.clock.blocks.append(Block(milliseconds, tuple(steps)))

    def tell(self, line: str) -> None:
        self.script.append(line)
        counts = self.clock.counts
        nibbles = [PHASES[count % len(PHASES)] for count in counts]
        room = QUEUE - len(self.clock.blocks)
        self.expected.append(" ".join(map(str, [*counts, *nibbles, room, self.clock.pace])))

    def tick(self, count: int) -> None:
        self.clock.run(count)
        self.tell(f"tick {count}")

    def hold(self) -> None:
        self.clock.hold()
        self.tell("hold")

    def resume(self) -> None:
        self.clock.resume()
        self.tell("resume")

    def drop(self) -> None:
        self.clock.drop()
        self.tell("drop")


def test_step_for_step_as_the_virtual_bridge(firmware: Path) -> None:
    rng = random.Random(5)
    both = Both()
    for _ in range(150):
        milliseconds = rng.choice((1, 7, 20, 333))
        both.push(milliseconds, [rng.randint(-4 * milliseconds, 4 * milliseconds) for _ in range(MOTORS)])
        both.tick(rng.choice((1, 13, 80, 700)))
        rng.choice((both.hold, both.resume, both.resume, both.resume))()
    both.resume()
    both.tick(200_000)
    assert both.clock.blocks == type(both.clock.blocks)()
    assert run(firmware, both.script) == both.expected


def test_a_hold_changes_when_steps_come_and_never_which(firmware: Path) -> None:
    both = Both()
    for _ in range(3):
        both.push(1000, (100, -50, 4000, 1, 0))
    both.tick(3000)
    both.hold()
    both.tick(1024)
    assert both.clock.pace == 0
    held_at = both.clock.counts
    both.tick(5000)
    assert both.clock.counts == held_at
    both.resume()
    both.tick(20_000)
    assert both.clock.counts == (300, -150, 12000, 3, 0)
    assert run(firmware, both.script) == both.expected


def test_what_is_dropped_is_forgotten_and_the_counts_stay(firmware: Path) -> None:
    both = Both()
    both.push(500, (99, 0, 0, 0, -7))
    both.tick(777)
    both.drop()
    both.tick(777)
    both.push(20, (1, 2, 3, 4, 5))
    both.tick(80)
    assert run(firmware, both.script) == both.expected


def test_impossible_blocks(firmware: Path) -> None:
    script = ["push 10 41 0 0 0 0", "push 0 0 0 0 0 0", "push 10001 1 0 0 0 0", "push 10 -40 0 0 0 0"]
    assert run(firmware, script) == ["impossible"] * 3 + ["pushed"]


def test_the_queue_is_as_long(firmware: Path) -> None:
    both = Both()
    for _ in range(QUEUE + 1):
        both.push(10, (1, 0, 0, 0, 0))
    assert both.expected[-1] == "full"
    assert run(firmware, both.script) == both.expected


def test_the_same_checksum(firmware: Path) -> None:
    bodies = ["12 B 20 5 -3 0 0 1", "~", "123456789"]
    told = run(firmware, [f"crc {body}" for body in bodies])
    assert [framed(body.encode()) for body in bodies] == [
        f"{body}*{crc}\n".encode() for body, crc in zip(bodies, told, strict=True)
    ]
    assert told[-1] == "29B1"  # the check value of CRC-16/CCITT-FALSE


ARDUINO = """
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
enum { OUTPUT, INPUT_PULLUP, LOW = 0, HIGH = 1, WGM12 = 3, CS11 = 1, OCIE1A = 1 };
#define ISR(vector) void vector()
#define _BV(bit) (1 << (bit))
extern uint8_t TCCR1A, TCCR1B, TIMSK1;
extern uint16_t OCR1A;
void digitalWrite(int, int);
int digitalRead(int);
void pinMode(int, int);
void noInterrupts();
void interrupts();
uint32_t millis();
struct Port { void begin(uint32_t); int available(); int read(); void print(const char*); };
extern Port Serial;
#include "latch-bridge.ino"
"""


def test_the_sketch_is_at_least_cpp() -> None:
    command = [str(COMPILER), "-std=c++11", "-Wall", "-Werror", "-fsyntax-only", f"-I{SOURCE}", "-xc++", "-"]
    done = subprocess.run(command, input=ARDUINO, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
