"""Responses for several fingers at once: which pitch and width keep fingers apart."""
