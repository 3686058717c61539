"""What every plate answers and shares: loads, modes, responses, mirrors."""
