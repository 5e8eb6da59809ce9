"""Matrix classes of M, with evidence. One module per property or group of properties.

The entries of M are taken as exact numbers, and no "yes" or "no" depends on rounding: what is found in double precision
is either guaranteed by an error bound or decided in exact arithmetic, or else it is "not decided".
"""
