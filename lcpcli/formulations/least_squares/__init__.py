"""Linear least squares with bounds and equations, solved without forming the product
A'A in the result.
"""
