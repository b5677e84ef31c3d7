"""Messages that only the perception nodes publish."""
