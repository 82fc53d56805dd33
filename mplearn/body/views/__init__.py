"""What is seen of a posture: features, key points, and both as motions are compared."""
