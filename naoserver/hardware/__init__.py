"""What a server of real hardware needs; that of the Nao stands on it, too (docs/how-to/own-hardware.md).

`servos` makes servos on a bus a whole robot, `serving` serves it, `sim_bus` is a bus to try both without
hardware. They stand on a connection that is lost and found again (`connection`), and on what is done at the
start and at the end (`lifecycle`).
"""
