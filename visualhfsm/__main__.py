"""Run `python -m visualhfsm`."""

from visualhfsm.cli import main

if __name__ == "__main__":
    main()
