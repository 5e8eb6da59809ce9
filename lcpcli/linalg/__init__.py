"""What numpy and scipy lack: products, factorizations, scaling, Krylov methods. It works on arrays, not problems."""
