"""The senses of the simulated robot: inertial unit, pressure under the feet, sonar, touch, battery.

MuJoCo's own sensors measure in the last physics step of a control tick. At its end `SensorRecord.look` copies
them into a record, with the errors of that tick when there is noise (`record`); the fall manager looks at
them, and the battery is drawn from (`simulated`). That is all that the thread of the physics does. What the
record means is computed on request: by the server, or the walk at each tick, with the same noise and
delay.
"""
