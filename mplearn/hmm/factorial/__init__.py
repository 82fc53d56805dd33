"""Factorial HMMs: several left-right chains whose outputs add up [Kulic2008b]."""
