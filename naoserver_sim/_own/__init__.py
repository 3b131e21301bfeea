"""A robot of the user: read from its model, an MJCF or URDF, and described as a body."""
