"""``python -m feeler``: the command line."""

from feeler.cli import main

if __name__ == "__main__":
    main()
