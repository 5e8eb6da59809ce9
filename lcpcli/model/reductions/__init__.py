"""Problems of other kinds that are solved as LCPs: the data it takes to map a solution back, one kind a module."""
