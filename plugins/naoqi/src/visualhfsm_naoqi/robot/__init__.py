"""The real robot: an implementation of `naoserver.robot.Robot` over libqi, and the command `naoserver-naoqi`.

Only `_libqi_link` imports `qi`; everything else uses `naoserver.hardware.connection`, which keeps a link
alive and finds a lost robot again. `_robot` prepares the robot at the start, leaves it at the end, and
combines the parts: `_state` (measurements), `_moves` (joints, walk and postures), `_cameras`, `_expression`
(lights, voice and sounds). `_switch` is the process that stops the robot when its server is killed.

`calls`, `background` and `dead_man` know nothing of NAOqi, and serve any hardware that answers calls by name
(docs/how-to/own-hardware.md).
"""
