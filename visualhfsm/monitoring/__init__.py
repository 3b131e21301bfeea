"""What all views of running components share: who runs, what they do and did, and the state of the robot."""
