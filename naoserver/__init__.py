"""What every robot server shares: the robot protocol, the servants, the safety layer and the facts of the H25."""
