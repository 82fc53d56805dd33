"""The self-contained page that shows what was learned and how it is performed."""
