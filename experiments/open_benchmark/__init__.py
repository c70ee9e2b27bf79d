"""The open benchmark's shipped round, answered by fogml and by what a user would pick instead."""
