"""Which methods are tried on a problem, in what order, and for how long. It uses
`methods` and the rooms above it."""
