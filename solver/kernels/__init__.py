"""Taichi functions of one world: geometry, contact list, contact forces, motion; and the kernel that runs a batch."""
