"""Who may move a robot, how far and how fast, and who stops it: what each command passes."""
