"""The real robot: an implementation of `naoserver.robot.Robot` over libqi, and the command `naoserver-naoqi`.

Only `libqi` imports `qi`; everything else uses the small protocol of `link`. `connection` keeps a link alive
and finds a lost robot again; `background_calls` makes calls without waiting. `robot` prepares the robot at
the start, leaves it at the end, and combines the parts: `state` (measurements), `joints`, `moves` (walk and
postures), `cameras`, `expression` (lights, voice and sounds).
"""
