#!/bin/sh
# SPDX-License-Identifier: MIT
# Takes out of a new root file system what must not be the same on two machines, and what would
# differ between two builds of the same inputs: clean-rootfs.sh ROOT
set -eu
root=$1

# Each machine makes its own identity at first boot.
echo uninitialized > "$root/etc/machine-id"
rm -f "$root/var/lib/dbus/machine-id" "$root/etc/resolv.conf" "$root/etc/hostname"
rm -f "$root/var/lib/systemd/random-seed" "$root/var/lib/systemd/credential.secret"

# Logs, caches and backups of the installation.
rm -rf "$root"/var/log/* "$root"/var/cache/* "$root"/var/lib/apt/lists/* "$root"/tmp/* "$root"/run/*
rm -f "$root"/var/lib/dpkg/*-old "$root"/etc/*- "$root"/etc/apt/sources.list
rm -rf "$root"/etc/apt/sources.list.d/* "$root"/var/backups/*
find "$root/usr/share/doc" -type d -empty -delete

# Nothing has to be brought up to date at first boot.
touch "$root/etc/.updated" "$root/var/.updated"
