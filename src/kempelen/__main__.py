"""``python -m kempelen`` is the `kempelen` command."""

from kempelen.cli.main import main

if __name__ == "__main__":
    main()
