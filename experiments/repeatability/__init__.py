"""Whether results repeat on another processor."""
