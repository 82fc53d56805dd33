"""Agents over a primitive graph: policies, walks, the report and the ``mplearn`` command."""
