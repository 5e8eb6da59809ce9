"""Families of problems by name, one per module, imported on demand: the family f is the function f.

A family is a function (n, seed, *, parameters) -> Problem of about n unknowns: the same numbers for the same arguments
on any machine (up to rounding, where a product of matrices is not of integers). Its keyword-only parameters have
defaults; a family without random entries calls its second argument _seed. Its module opens with the source, repeated
in SOURCE; CLASS is the class of its matrices, and SIZE the number of unknowns if it is fixed.
"""
