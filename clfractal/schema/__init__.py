"""How the parts of a scene are declared: sections, fields with what is known of them, kinds, errors."""
