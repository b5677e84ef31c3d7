"""Driving among random obstacles."""
