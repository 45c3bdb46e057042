"""A laboratory's files become a folder of measured data (`doe.measurement`): `explorer new measurement`."""
