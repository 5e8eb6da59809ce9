"""Contact with Coulomb friction as engineers hold it: boxed problems with friction
indices, Delassus matrices, and which contacts separate, stick or slide."""
