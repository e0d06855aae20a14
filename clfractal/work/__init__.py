"""How every picture is made: jobs of views, engines, executors."""
