"""The families of game trees in the gallery: name | meaning | class of M | source."""

# The family after which these are listed, and their table under the name of their
# module.
FAMILIES = (
    "bimatrix",
    """
families:
poker | poker with one card of each rank, a game tree | copositive | after Kuhn 1950
bargaining | offers under incomplete information, a game tree | copositive | \
after Chatterjee and Samuelson 1983
""",
)
