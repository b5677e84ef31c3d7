"""Build script of the ament_python package, whose metadata is in setup.cfg."""

from setuptools import setup

setup()
