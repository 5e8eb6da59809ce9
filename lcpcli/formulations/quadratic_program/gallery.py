"""The families of programs in the gallery: name | meaning | class of M | source."""

# The families follow the family boxes in the gallery; the heading names their module.
FAMILIES = (
    "boxes",
    """
families:
lp | random linear program and its dual | skew-symmetric | \
Dantzig and Cottle 1967, random program
qp | random convex quadratic program | PSD | Cottle and Dantzig 1968, random program
portfolio | least variance with a factor model, a program | PSD | \
Markowitz 1952, random factor model
frontier | efficient frontier, as a target return or its weight varies | PSD | \
Markowitz 1956, random factor model
lasso | regularization path, as a penalty varies | PSD | \
Tibshirani 1996, random features
control | masses and springs under bounded forces, a program | PSD | \
chain of masses and springs, Borrelli, Bemporad and Morari 2017, chapter 11
transport | least cost from plants to markets, a linear program | PSD | \
Hitchcock 1941, random integers
""",
)
