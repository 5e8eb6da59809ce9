"""To which classes of matrices M belongs, with what shows it. One property or group of properties, one module.

The entries of M are taken as the exact numbers that they are, and no "yes" or "no" depends on rounding: what is found
in double precision is either safe by an error bound or decided in exact arithmetic, or else it is "not decided".
"""
