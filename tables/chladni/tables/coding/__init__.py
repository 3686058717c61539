"""How a table's integers and its responses lie in bytes."""
