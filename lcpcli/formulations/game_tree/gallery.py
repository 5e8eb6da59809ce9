"""The families of game trees in the gallery: name | meaning | class of M | source."""

# In the gallery behind bimatrix, in the module of the heading.
FAMILIES = (
    "bimatrix",
    """
families:
poker | poker with one card of each rank, a game tree | copositive | after Kuhn 1950
bargaining | offers under incomplete information, a game tree | copositive | \
after Chatterjee and Samuelson 1983
""",
)
