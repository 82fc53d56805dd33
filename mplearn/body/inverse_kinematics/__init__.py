"""From frames of markers to postures, on-line, of a body that is fitted to the person."""
