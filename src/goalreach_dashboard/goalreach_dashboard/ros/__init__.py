"""Subscriptions, parameters and commands of the live page."""
