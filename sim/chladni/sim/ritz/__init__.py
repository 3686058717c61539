"""Ritz solution of a rectangular plate with screws, pins, springs, glued discs and holes."""
