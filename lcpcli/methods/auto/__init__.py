"""The method `auto`: its policy, and the stages that belong to no published method."""
