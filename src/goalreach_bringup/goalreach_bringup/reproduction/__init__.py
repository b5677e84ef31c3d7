"""The evidence behind REPRODUCTION.md: studies, their results on disk, and the document."""
