"""The mathematics that several rooms need, each formula once; nothing here knows of people."""
