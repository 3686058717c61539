"""What host and device agree on: the declarations that C++ headers come from."""
