"""Run the command as `python -m naoserver_naoqi`."""

from naoserver_naoqi.cli import main

main()
