"""Taichi functions of one world: geometry, contact list, contact forces, motion; and the kernel that runs a batch.

``a[w, b] = a[w, b] + x``, never ``+=``: Taichi makes the latter an atomic operation, which a world that runs on one
thread does not need and which costs a quarter of a pour's time.
"""
