"""eigenshape hears the shape of things."""
