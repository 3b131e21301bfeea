"""Run the command as `python -m naoserver_sim`."""

from naoserver_sim.cli import main

main()
