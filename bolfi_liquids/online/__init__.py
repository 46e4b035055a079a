"""Learn while the robot stirs."""
