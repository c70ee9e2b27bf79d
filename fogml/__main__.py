"""``python -m fogml``: the program ``fogml``."""

from fogml.cli.main import main

if __name__ == "__main__":
    main()
