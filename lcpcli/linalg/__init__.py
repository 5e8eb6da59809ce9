"""What numpy and scipy lack: products, factorizations, scaling and Krylov methods, for
arrays rather than problems."""
