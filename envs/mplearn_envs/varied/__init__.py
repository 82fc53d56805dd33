"""The varied library: many primitives, several people, and what the humanoid makes of it."""
