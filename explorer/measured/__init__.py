"""What a laboratory brings, as a folder of measured data (`doe.measurement`): `explorer new measurement`."""
