"""The clocks that a component may go by: the wall's, the robot's, and a test's own."""
