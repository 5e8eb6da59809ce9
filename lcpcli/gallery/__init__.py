"""Families of problems by name, one a module, imported when they are asked for: the family f is the function f.

A family is a function (n, seed, *, parameters) -> Problem of about n unknowns: the same numbers for the same arguments,
whatever the machine (to rounding, where a product of matrices is not of integers). Its keyword-only parameters have
defaults; one whose numbers are fixed calls its second argument _seed. Its module opens with the source, which stands in
SOURCE too, and tells in CLASS to which class its matrices belong; SIZE is there if it is of one size only.
"""
