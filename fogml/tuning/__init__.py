"""Search spaces and studies: which features, model and sizes do best on held-out parts of the training runs."""
