"""Games of any number of players whose equilibria are those of a linear complementarity
problem: with quadratic costs, or with payoffs that are sums over pairs."""
