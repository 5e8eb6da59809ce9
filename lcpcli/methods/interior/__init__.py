"""The interior point method: set-up, linear systems, steps, and the active set that ends it."""
