"""What the house measures, beside what it measured before it was tidied."""
