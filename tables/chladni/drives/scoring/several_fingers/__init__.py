"""What a board keeps apart of several fingers at once, as drawn, within tolerances and as built."""
