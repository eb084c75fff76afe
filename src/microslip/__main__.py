"""``python -m microslip``: the command line."""

from microslip.cli.main import main

if __name__ == "__main__":
    main()
