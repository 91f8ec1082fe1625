"""A camera's process: ``python -m kempelen.frames N``, N being the descriptor of its owner's channel."""

import socket
import sys

from kempelen.frames.channel import Channel
from kempelen.frames.serve import serve


def main() -> int:
    """Serve one camera until its owner has gone."""
    channel = Channel(socket.socket(fileno=int(sys.argv[1])))
    try:
        return serve(channel)
    finally:
        channel.close()


if __name__ == "__main__":
    sys.exit(main())
