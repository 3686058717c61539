"""A board as a laboratory measured it: what coils do at places, from files of its instruments."""
