"""Follow, steer, record and replay components and their robot: `realm` is the base of all views of them.

`followers` follow what the page shows, `stopping` stops a robot until it says that it is still; `recorder`,
`recordings` and `replay` are of recordings, `cameras` and `poses` of the robot, and `run_page` makes a run
one HTML file.
"""
