"""What a scanner sees: partial scans, depth images, and the rasterizer behind them."""
