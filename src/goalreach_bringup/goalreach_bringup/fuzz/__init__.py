"""Bad input for every reader: made at random, from sound input and from nothing."""
