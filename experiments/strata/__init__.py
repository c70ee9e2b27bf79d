"""`auto` against a fit of the true effects, on simulated units of five strata of effects."""
