"""Who does a task how well: contestants, their episodes, the tables."""
