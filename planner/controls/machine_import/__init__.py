"""Machine files from the settings of a control: LinuxCNC, grbl, Klipper, Marlin."""
