"""Units in service: what their model leaves on every run, and when that changed."""
