"""Ritz solution of a free rectangular plate with clamped screws and glued discs."""
