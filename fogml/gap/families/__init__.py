"""The diagnosis on families: one linear-Gaussian model in which a cause is all that it can do."""
