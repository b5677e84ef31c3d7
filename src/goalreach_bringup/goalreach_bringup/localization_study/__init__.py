"""The studies behind docs/LOCALIZATION.md: how well, how honestly and how long the eyes see."""
