"""What environments observe: observables, cameras, and how pictures are drawn."""
