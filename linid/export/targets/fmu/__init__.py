"""The target `fmu`: functional mock-up units of FMI 2.0 and 3.0 for co-simulation, with their C sources."""
