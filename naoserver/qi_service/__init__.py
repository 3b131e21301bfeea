"""Serve any robot as NAOqi over libqi, so that programs written for NAOqi drive it.

It stands beside the servants, not in a package of its own, because it is one more way in to whatever
implements `Robot`: the simulated robot (`naoserver-sim --qi`), and the fake one
(`python -m naoserver.qi_service`), which stands for a real robot in the tests of `naoserver_naoqi`. Commands
take the way of every other: through `GuardedDevice` and its kin, never straight to the robot. Only this
package of `naoserver` imports `qi`, of the extra `[naoqi]`.

Where NAOqi is ambiguous it does as NAOqi 2.8 on a NAO6. docs/virtual-nao.md tells what is there.
"""
