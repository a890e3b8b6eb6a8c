# SPDX-License-Identifier: MIT
# Boot script of all machines: chooses a slot and starts its kernel. U-Boot's built-in environment (MACHINE.env)
# has loaded it from the first partition of a disk; devtype and devnum are that disk.
#
# The boot state is kept twice, in front of the first partition, in the format of U-Boot's redundant environment,
# which fw_printenv, fw_setenv and RAUC use as well: CRC-32, counter of 8 bits, names and values. The copy with a
# good CRC and the later counter is valid; only the other one is written. So a power cut leaves one that is whole.
# Places and sizes are those of fw_env.config; here they are hexadecimal, and places in blocks of 512 bytes of the
# whole disk, ":0" (without it U-Boot takes a partition).
setenv state_bytes 4000
setenv state_blocks 20
setenv state_at_0 800
setenv state_at_1 1000
setenv state_names BOOT_ORDER BOOT_A_LEFT BOOT_B_LEFT
setexpr counter_addr ${state_addr} + 4
# Of a new state, and of a slot that may be tried again.
setenv tries 3

setenv read_state 'read ${devtype} ${devnum}:0 ${state_addr} ${at} ${state_blocks} && env import -c ${state_addr} ${state_bytes} ${state_names}'
setenv write_state 'env export -c -s ${state_bytes} ${state_addr} ${state_names}; setexpr counter ${counter} + 1; setexpr counter ${counter} "&" ff; mw.b ${counter_addr} ${counter}; write ${devtype} ${devnum}:0 ${state_addr} ${at} ${state_blocks} || echo "ecdaq: boot state not written"; if test ${at} = ${state_at_0}; then setenv at ${state_at_1}; else setenv at ${state_at_0}; fi'

# Which copies are whole, and which of two is the later one. The counter overflows.
setenv good_0 no
setenv good_1 no
setenv at ${state_at_0}
if run read_state; then
	setenv good_0 yes
	setexpr.b counter_0 *${counter_addr}
fi
setenv at ${state_at_1}
if run read_state; then
	setenv good_1 yes
	setexpr.b counter_1 *${counter_addr}
fi
setenv current none
if test ${good_0} = yes; then
	setenv current 0
fi
if test ${good_1} = yes; then
	if test ${good_0} = no; then
		setenv current 1
	elif itest.b ${counter_1} -gt ${counter_0}; then
		setenv current 1
	fi
fi
if test ${good_0}${good_1} = yesyes; then
	if test ${counter_0} = ff -a ${counter_1} = 0; then
		setenv current 1
	elif test ${counter_1} = ff -a ${counter_0} = 0; then
		setenv current 0
	fi
fi

# The valid copy's values; at: where the next one is written.
if test ${current} = 0; then
	setenv at ${state_at_0}
	run read_state
	setenv counter ${counter_0}
	setenv at ${state_at_1}
elif test ${current} = 1; then
	setenv at ${state_at_1}
	run read_state
	setenv counter ${counter_1}
	setenv at ${state_at_0}
else
	echo "ecdaq: no valid boot state, defaults are used"
	env delete -f ${state_names}
	setenv counter 0
	setenv at ${state_at_0}
fi
test -n "${BOOT_ORDER}" || setenv BOOT_ORDER A B
test -n "${BOOT_A_LEFT}" || setenv BOOT_A_LEFT ${tries}
test -n "${BOOT_B_LEFT}" || setenv BOOT_B_LEFT ${tries}

# Words for the kernel that an operator or a test adds; the file may have line ends of DOS.
setenv append
if test -e ${devtype} ${devnum}:1 /ecdaq/kernel.env; then
	load ${devtype} ${devnum}:1 ${scratch_addr} /ecdaq/kernel.env && env import -t -r ${scratch_addr} ${filesize} append
fi

# A slot is a root file system: partition 2 or 3. It has its kernel, device trees and command line in slot_dir.
setenv slot_dir /usr/lib/ecdaq/slot
setenv load_slot 'part uuid ${devtype} ${devnum}:${part} uuid && load ${devtype} ${devnum}:${part} ${scratch_addr} ${slot_dir}/slot.env && env import -t ${scratch_addr} ${filesize} cmdline && load ${devtype} ${devnum}:${part} ${kernel_addr_r} ${slot_dir}/kernel && run load_tree'
setenv start_slot 'setenv bootargs "${cmdline} root=PARTUUID=${uuid} rauc.slot=${slot} ${append}"; booti ${kernel_addr_r} - ${tree_addr}'
# The try is counted before anything of the slot is used.
setenv try_slot 'setexpr left ${left} - 1; setenv BOOT_${slot}_LEFT ${left}; run write_state; echo "ecdaq: slot ${slot}, tries left: ${left}"; if run load_slot; then run start_slot; fi; echo "ecdaq: slot ${slot} cannot be started"'

for name in ${BOOT_ORDER}; do
	setenv slot ${name}
	setenv left 0
	if test ${slot} = A; then
		setenv part 2
		setenv left ${BOOT_A_LEFT}
	elif test ${slot} = B; then
		setenv part 3
		setenv left ${BOOT_B_LEFT}
	fi
	if itest ${left} -gt 0; then
		run try_slot
	fi
done

echo "ecdaq: no slot is left, each gets its tries again"
setenv BOOT_ORDER A B
setenv BOOT_A_LEFT ${tries}
setenv BOOT_B_LEFT ${tries}
run write_state
reset
