"""Other solvers; lcpcli.peers.registry lists them and defines the interface of a
peer."""
