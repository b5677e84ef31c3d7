"""The figures of the paper. Modules in here import matplotlib."""
