"""Finite elements for plates, written apart from `chladni.sim` to check it.

Argyris triangles, but with a curvature of its own per triangle at the vertices of a rim: textbook
Argyris elements share the curvature there, which is wrong where the stiffness jumps and makes a
glued disc act about one percent larger than it is. scikit-fem checks these elements in turn.
"""
