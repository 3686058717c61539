"""What a board is: its parts, its file, its checks. Knows no plate."""
