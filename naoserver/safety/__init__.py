"""Who may move a robot, how far and how fast, and who stops it: what each command passes.

`guarded_device` is what servants command: who moves which joints. `gate` is one gate for every command, with
a lease that shuts other writers out, and an emergency stop that latches, also in a file (`latch`), where the
next server finds it; its reset starts nothing of who commanded before it (`commanders`, decision 26).
`limits` refuses, clamps and slows commands, stops a velocity that is not renewed within half a second, and
holds the joints that a lost client moves: in simulation as on the real robot. `gain_guard` does so for
commands with gains, which end damped and held. `event_log` has the events of the health report: falls and
heat, joints that do not follow, servos that are lost or report a fault, of every robot.

Deadlines that keep the robot safe use the steady wall clock, whatever the robot's time does.
"""
