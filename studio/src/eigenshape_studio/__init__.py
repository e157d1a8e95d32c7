"""The studio of eigenshape: a window on shapes, in the browser, in notebooks and in one file."""
