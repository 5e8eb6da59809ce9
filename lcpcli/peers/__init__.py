"""Other solvers, which lcpcli.peers.registry lists; it says what a peer provides."""
