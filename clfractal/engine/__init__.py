"""How pictures are rendered: jobs of views, engines, executors."""
