"""Pictures off screen, a window, and balance drawn on the floor."""
