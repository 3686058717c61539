"""What all commands share: options, answers, progress."""
