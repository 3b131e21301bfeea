"""What every robot server shares: the robot protocol, the servants, the safety layer, the H25's facts."""
