"""The whole chain in a few minutes: a person's markers, primitives, a walk, a report."""
