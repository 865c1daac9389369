"""ridelog on a whole machine: real systemd, udev, kernel, disks, sticks and power cuts, in a guest."""
