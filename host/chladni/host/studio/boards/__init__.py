"""Boards of pages: chosen, made ready, searched for, and as a page draws them."""
