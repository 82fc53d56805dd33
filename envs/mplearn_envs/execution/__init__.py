"""Who performs plans, simulated or kinematic, and what is measured meanwhile."""
