"""The bodies themselves: the human and the robot as MJCF, at any size."""
