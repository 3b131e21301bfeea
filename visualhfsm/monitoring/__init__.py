"""What all views of running components share: their discovery, state and history, and the robot's state."""
