"""The Gymnasium environments: what a step is, what is observed, what it earns."""
