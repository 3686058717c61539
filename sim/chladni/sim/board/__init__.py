"""What a board is: its parts, its file, its checks. Imports no plate model."""
