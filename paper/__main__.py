"""``python -m paper``: the same as ``feeler reproduce``, with its options."""

import sys

from feeler.cli import main

if __name__ == "__main__":
    sys.argv.insert(1, "reproduce")
    main()
