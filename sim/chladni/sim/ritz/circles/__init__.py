"""Functions that circles bring into the basis: their terms, derivatives and mirror images."""
