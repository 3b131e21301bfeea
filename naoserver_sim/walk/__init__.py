"""The walk of the simulated robot: where the feet go, what the legs do for it, and where it has got to."""
