"""Draw the twin's portrait for the README: python bench/portrait.py FILE.png (MUJOCO_GL=egl or osmesa)."""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from kempelen.core.places import Place
from kempelen.core.table import Table, start_layout
from kempelen.game.fen import parse_fen
from kempelen.twin.physics.scene import Scene
from kempelen.twin.physics.world import World

POSITION = "r1bqk2r/pppp1ppp/2n2n2/2b1p3/2B1P3/5N2/PPPP1PPP/RNBQ1RK1 b kq - 5 4"
SIZE = (1280, 800)


def png(picture: npt.NDArray[np.uint8]) -> bytes:
    """(h, w, 3) RGB as a PNG file (W3C Portable Network Graphics, 3rd edition)."""
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + row.tobytes() for row in picture)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows, 9)),
        (b"IEND", b""),
    )
    body = b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body


def main() -> None:
    """A position of the Italian game, the hand above the knight that moves next."""
    table = Table()
    scene = Scene.from_layout(table, start_layout(table, parse_fen(POSITION)), seed=3, scatter=1.0)
    x, y, _ = table.centre(Place("f6")).tolist()
    world = World(scene, joints=(x, y, 110.0))
    Path(sys.argv[1]).write_bytes(png(world.render(*SIZE, "portrait")))


if __name__ == "__main__":
    main()
