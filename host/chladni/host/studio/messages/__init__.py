"""What pages and server say to each other: who may, requests within bounds, and the way back."""
