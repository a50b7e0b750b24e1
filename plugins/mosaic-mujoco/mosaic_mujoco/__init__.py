"""Any MuJoCo model as a robot of MOSAIC."""
