"""The real robot: what implements `naoserver.robot.Robot` over libqi, and the command `naoserver-naoqi`.

`libqi` alone imports `qi`; all else stands on the small protocol of `link`. `connection` keeps a link alive
and finds the robot again when it was lost, `background_calls` makes calls that nobody waits for. `robot` puts
the parts together and looks after the robot at start and end: `state` (what is measured), `joints`, `moves`
(walk and postures), `cameras`, `expression` (lights and voice).
"""
