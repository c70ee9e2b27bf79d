"""What others would carry in firmware, or pick on a computer, on every real pairing and simulated stratum."""
