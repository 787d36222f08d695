"""A run as pictures, as a film, as files for other programs."""
