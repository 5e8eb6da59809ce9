"""All solutions of a problem, and all equilibria of a game."""
