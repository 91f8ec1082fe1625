"""A ring to write to."""

from collections.abc import Iterator

import pytest

from kempelen.frames.layout import frame_bytes
from kempelen.frames.ring import RingWriter, ring_name
from kempelen.testing.rings import numbered


@pytest.fixture
def writer() -> Iterator[RingWriter]:
    """Of four slots."""
    with RingWriter(ring_name("test"), 4, frame_bytes(numbered(0))) as opened:
        yield opened
