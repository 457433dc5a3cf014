"""touchd turns any surface under a depth camera into a multi-touch screen."""
