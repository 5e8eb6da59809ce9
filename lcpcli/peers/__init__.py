"""Other solvers, one module each; lcpcli.peers.registry says what such a module provides."""
