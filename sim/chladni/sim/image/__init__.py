"""Energy images, and how they are judged."""
