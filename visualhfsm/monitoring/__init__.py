"""What all views of running components share: their discovery, state and run log, and the robot's state."""
