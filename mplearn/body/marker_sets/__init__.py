"""Which markers sit where on a body, and what holds between them however it moves."""
