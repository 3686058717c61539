"""What a finished table is asked: its board, whether it is whole, how it differs, its drives."""
