"""The base of all views of running components: discovery, state and run log, and the robot's state."""
