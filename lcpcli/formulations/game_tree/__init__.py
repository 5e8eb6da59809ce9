"""Games of two players in extensive form: .efg files, the sequence form, and behavior
strategies."""
