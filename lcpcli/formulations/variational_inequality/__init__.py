"""Affine variational inequalities on polyhedra."""
