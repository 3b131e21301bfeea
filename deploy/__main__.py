"""Run `python -m deploy STACK.toml`."""

from deploy.cli import main

if __name__ == "__main__":
    main()
