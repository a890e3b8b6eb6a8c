# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Sourced by the scripts that build for arm64; expects die().

# arm64 programs (maintainer scripts of packages, programs that write their own pages) run through QEMU's user mode.
need_arm64_programs()
{
	if ! arch-test arm64 > /dev/null 2>&1; then
		[ -e /proc/sys/fs/binfmt_misc/register ] ||
			mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc 2> /dev/null ||
			die "this kernel has no binfmt_misc, which runs arm64 programs"
		update-binfmts --enable qemu-aarch64 > /dev/null 2>&1 || :
	fi
	arch-test arm64 > /dev/null 2>&1 ||
		die "arm64 programs do not run here: is qemu-user-static installed?"
}
