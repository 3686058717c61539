"""The command that scores several fingers: drawn sets of them, or two of one's own."""
