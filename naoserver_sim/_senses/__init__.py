"""The senses of the simulated robot: inertial unit, pressure under the feet, sonar, touch, battery.

MuJoCo's own sensors measure in the last physics step of a control tick. At its end `SensorRecord.sample`
copies them into a record, with the errors of that tick when there is noise (`record`); the fall manager
checks them, and the battery is discharged (`simulated`). The thread of the physics does nothing else.
Readings are computed from the record on request: by the server, or by the walk at each tick, with the same
noise and delay.
"""
