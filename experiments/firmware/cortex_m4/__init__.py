"""Exported C on a Cortex-M4 under QEMU, for as long as a unit runs."""
