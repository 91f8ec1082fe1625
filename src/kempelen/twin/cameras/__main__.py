"""A camera's process: ``python -m kempelen.twin.cameras FD``, started by the twin alone."""

import sys

from kempelen.twin.cameras.process import main

if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
