"""The senses of the simulated robot: inertial unit, pressure under the feet, sonar, touch, battery.

MuJoCo's own sensors measure in the last physics step of a control tick (`sensors`). At its end
`SensorRecord.look` copies them into a record, with the errors of that tick when there is noise (`record`,
`noise`); the fall manager looks at them, and the battery is drawn from (`falls`, `battery`). That is all that
the thread of the physics does. What the record means is worked out when somebody asks (`simulated`).

A controller that is a part of every tick asks the record, in the thread of the physics:

    record.turning()    turning rate of the torso in rad/s about its own x, y and z
    record.tilt()       roll and pitch of the torso against the vertical in rad
    record.loads()      what the left and the right sole carry in N

With noise these are as noisy and as late as the readings that are served.
"""
