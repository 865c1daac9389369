# Runs in the guest, sourced by bash: sticks made of the kernel's scsi_debug, whose disks are memory. udev is made to
# believe that they hang on USB, while /run/on-usb exists. Stick N (0, 1, ...) keeps its content while it is pulled.

sticks_ready() { # how many, of how many MB each
    echo 'SUBSYSTEM=="block", KERNEL=="sd*", TEST=="/run/on-usb", ENV{ID_BUS}="usb"' >/etc/udev/rules.d/89-bench.rules
    udevadm control --reload
    modprobe sd_mod
    modprobe scsi_debug dev_size_mb=$2 per_host_store=1 add_host=$1 removable=1
    for n in $(seq 0 $(($1 - 1))); do
        for i in $(seq 100); do [ -n "$(stick $n)" ] && break; sleep 0.1; done
        pull $n
    done
}

stick() { # its name, such as sda; nothing while it is pulled
    ls -d /sys/bus/pseudo/devices/adapter$1/host*/target*/*/block/* 2>/dev/null | sed 's|.*/||'
}

pull() { # without asking anybody
    echo 1 >/sys/block/$(stick $1)/device/delete
    while [ -n "$(stick $1)" ]; do sleep 0.02; done
}

plug() {
    touch /run/on-usb
    scan $1
}

scan() {
    echo '- - -' >$(ls -d /sys/bus/pseudo/devices/adapter$1/host*/scsi_host/host*/scan)
    for i in $(seq 100); do [ -n "$(stick $1)" ] && break; sleep 0.05; done
}

load() { # stick N with the content of a file, pulled again, and nobody has taken it for a stick
    rm -f /run/on-usb
    scan $1
    udevadm settle
    dd if=$2 of=/dev/$(stick $1) bs=1M conv=fsync status=none
    udevadm settle
    pull $1
}

look() { # at the content of stick N, read only, with a command in its folder
    mkdir -p /mnt/look
    mount -o ro,noload /dev/$(stick $1) /mnt/look 2>/dev/null || mount -o ro /dev/$(stick $1) /mnt/look
    (cd /mnt/look && eval "$2")
    rc=$?
    umount /mnt/look
    return $rc
}
