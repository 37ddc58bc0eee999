"""`hvcpctl`: what a person types to try, watch and control robots."""
