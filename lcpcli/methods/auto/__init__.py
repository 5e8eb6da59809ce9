"""The method `auto`: its policy, and the stages that no published method has by itself."""
