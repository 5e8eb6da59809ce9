"""Games of two players in strategic form: payoffs in two matrices, .nfg files, mixed
strategies, and all equilibria."""
