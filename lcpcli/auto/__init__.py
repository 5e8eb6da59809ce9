"""Which methods are run on a problem, in what order, and for how long. It uses
`methods` and the subpackages above it."""
