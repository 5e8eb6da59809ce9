"""Exact answers: the numbers of a file as rationals, and what rational arithmetic proves about the problem.

A decimal number stands for itself here: 0.1 is 1/10, not the double nearest to it. Floating point finds out where to
look, an active set or the support of a Farkas vector; what is found is then solved for, and checked, without rounding.
"""
