"""Key points of animals and people from pictures, 2-D or 3-D, seen from the body itself."""
