"""Commands that write a board as it was measured."""
