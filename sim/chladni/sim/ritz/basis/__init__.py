"""The functions that a plate is solved in: polynomials and circles, their parity, quadrature."""
