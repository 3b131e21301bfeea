"""Shared by all robot servers: the robot protocol, the servants, the safety layer, the bodies of robots."""
