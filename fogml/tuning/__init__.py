"""Search spaces and studies: what does best on held-out parts of the training runs."""
