"""The studio: a page on which boards vibrate, and the server that runs a device for each page."""
