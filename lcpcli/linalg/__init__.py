"""What numpy and scipy lack: products, factorizations, scaling, Krylov methods. It knows arrays, not problems."""
