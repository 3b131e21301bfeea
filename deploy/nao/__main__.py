"""Run `python -m deploy.nao`."""

from deploy.nao.cli import main

if __name__ == "__main__":
    main()
