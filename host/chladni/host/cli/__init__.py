"""The command line: a file per group of commands, thin over everything below."""
