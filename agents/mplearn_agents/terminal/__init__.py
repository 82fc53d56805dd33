"""What all commands share: options, text that is only text, tables, Ctrl-C, what they return."""
