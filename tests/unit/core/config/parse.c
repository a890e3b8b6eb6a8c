/* SPDX-License-Identifier: MIT */
#include <errno.h>
#include <math.h>

#include "config/config.h"
#include "config/output.h"
#include "harness/test.h"
#include "unit/core/config/parsing.h"

TEST(config, empty_file_gives_the_defaults)
{
	static struct config cfg;
	static struct config defaults;

	config_defaults(&defaults);
	parse_ok("", &cfg);
	CHECK_STR(cfg.path, "t.yaml");
	cfg.path[0] = '\0';
	memset(cfg.path, 0, sizeof(cfg.path));
	CHECK_MEM(&cfg, &defaults, sizeof(cfg));
	parse_ok("# nothing but a comment\n", &cfg);
	parse_ok("---\n...\n", &cfg);
	parse_ok("cycle:\nbus: ~\nslaves:\n", &cfg);
	CHECK_EQ(cfg.slave_count, 0);
}

TEST(config, defaults_are_those_of_the_design)
{
	static struct config cfg;

	config_defaults(&cfg);
	CHECK_EQ(cfg.cycle_period_ns, 1000000);
	CHECK(cfg.cycle_phase_percent == 50.0);
	CHECK(cfg.cycle_receive_percent == 40.0);
	CHECK_EQ(cfg.cycle_cpu, -1);
	CHECK_EQ(cfg.cycle_priority, 80);
	CHECK_EQ(cfg.cycle_poll, CONFIG_POLL_AUTO);
	CHECK_EQ(cfg.dc_lock_limit_ns, 10000);
	CHECK_EQ(cfg.dc_lock_cycles, 200);
	CHECK_EQ(cfg.dc_unlock_limit_ns, 50000);
	CHECK_EQ(cfg.dc_slew_ns, 20000);
	CHECK(cfg.dc_kp == 0.02 && cfg.dc_ki == 0.0001);
	CHECK_EQ(cfg.dc_burst_frames, 15000);
	CHECK_EQ(cfg.ring_depth_ns, INT64_C(64000000000));
	CHECK_EQ(cfg.record_chunk_period_ns, 100000000);
	CHECK_EQ(cfg.record_sync_period_ns, 1000000000);
	CHECK_EQ(cfg.record_rotate_period_ns, INT64_C(600000000000));
	CHECK_EQ(cfg.record_rotate_bytes, 256u << 20);
	CHECK_EQ(cfg.record_budget_bytes, UINT64_C(8) << 30);
	CHECK_EQ(cfg.record_reserve_bytes, 64u << 20);
	CHECK_EQ(cfg.record_compression, 1);
	CHECK_EQ(cfg.bus_presence, CONFIG_ANY_SLAVES);
}

TEST(config, values_carry_units_and_are_exact)
{
	static struct config cfg;

	parse_ok("cycle:\n"
		 "  period: 0.25 ms\n"
		 "  phase: 12.5%\n"
		 "  receive: 30\n"
		 "  cpu_dma_latency: 1ms\n"
		 "dc:\n"
		 "  slew: 10.001us\n"
		 "  burst_frames: 20 frames\n"
		 "  kp: 1e-2\n"
		 "ring:\n"
		 "  depth: 1.5min\n"
		 "record:\n"
		 "  enable: no\n"
		 "  rotate_size: 100MB\n"
		 "  budget: 1024TiB\n"
		 "  reserve: 3\n",
		 &cfg);
	CHECK_EQ(cfg.cycle_period_ns, 250000);
	CHECK(cfg.cycle_phase_percent == 12.5);
	CHECK(cfg.cycle_receive_percent == 30.0);
	CHECK_EQ(cfg.cycle_cpu_dma_latency_us, 1000);
	CHECK_EQ(cfg.dc_slew_ns, 10001);
	CHECK_EQ(cfg.dc_burst_frames, 20);
	CHECK(cfg.dc_kp == 0.01);
	CHECK_EQ(cfg.ring_depth_ns, INT64_C(90000000000));
	CHECK_EQ(cfg.record_enable, 0);
	CHECK_EQ(cfg.record_rotate_bytes, 100000000);
	CHECK_EQ(cfg.record_budget_bytes, UINT64_C(1) << 50);
	CHECK_EQ(cfg.record_reserve_bytes, 3u << 20);
}

TEST(config, slaves_and_their_objects_are_read_in_order)
{
	static struct config cfg;

	parse_ok("slaves:\n"
		 "  - name: piccolo0\n"
		 "    vendor: 2\n"
		 "    product: 0x04570862\n"
		 "    revision: 0x0258008d\n"
		 "    mode: oneshot\n"
		 "    sync0_shift: -100us\n"
		 "    sdo:\n"
		 "      - { index: 0x8000, subindex: 2, type: UINT, value: 10 }\n"
		 "      - value: -1\n"
		 "        type: dint\n"
		 "        index: 0x6000\n"
		 "  - {}\n"
		 "  - alias: 0x1234\n"
		 "    assign_activate: 0x0700\n"
		 "    sdo: [ { index: 0x7000, type: REAL, value: 0.5 } ]\n",
		 &cfg);
	CHECK_EQ(cfg.slave_count, 3);
	CHECK_STR(cfg.slave[0].name, "piccolo0");
	CHECK_EQ(cfg.slave[0].vendor, 2);
	CHECK_EQ(cfg.slave[0].product, 0x04570862);
	CHECK_EQ(cfg.slave[0].revision, 0x0258008d);
	CHECK_EQ(cfg.slave[0].mode, CONFIG_MODE_ONESHOT);
	CHECK_EQ(cfg.slave[0].sync0_shift_ns, -100000);
	CHECK_EQ(cfg.slave[0].line, 2);
	CHECK_EQ(cfg.slave[1].vendor, 0);
	CHECK_EQ(cfg.slave[2].alias, 0x1234);
	CHECK_EQ(cfg.slave[2].assign_activate, 0x0700);
	CHECK_EQ(cfg.sdo_count, 3);
	CHECK_EQ(cfg.sdo[0].index, 0x8000);
	CHECK_EQ(cfg.sdo[0].subindex, 2);
	CHECK_EQ(cfg.sdo[0].bytes, 2);
	CHECK_EQ(cfg.sdo[0].value, 10);
	CHECK_EQ(cfg.sdo[0].line, 9);
	CHECK_EQ(cfg.sdo[1].index, 0x6000);
	CHECK_EQ(cfg.sdo[1].bytes, 4);
	CHECK_EQ(cfg.sdo[1].value, 0xffffffff);
	CHECK_EQ(cfg.sdo[2].slave_pos, 2);
	CHECK_EQ(cfg.sdo[2].value, 0x3f000000);
	CHECK_EQ(cfg.bus_presence, CONFIG_EXACT_SLAVES);
}

TEST(config, one_shot_is_the_mode_or_the_object_that_the_mode_would_write)
{
	static struct config cfg;

	parse_ok("slaves:\n"
		 "  - mode: oneshot\n"
		 "  - sdo: [ { index: 0x8000, subindex: 1, type: USINT, value: 1 } ]\n"
		 "  - sdo: [ { index: 0x8000, subindex: 2, type: UINT, value: 1 } ]\n"
		 "  - mode: periodic\n",
		 &cfg);
	CHECK_EQ(config_is_oneshot(&cfg, 0), 1);
	CHECK_EQ(config_is_oneshot(&cfg, 1), 1);
	CHECK_EQ(config_is_oneshot(&cfg, 2), 0);
	CHECK_EQ(config_is_oneshot(&cfg, 3), 0);
	CHECK_EQ(config_is_oneshot(&cfg, 60), 0);
}

TEST(config, explicit_presence_overrides_the_derived_one)
{
	static struct config cfg;

	parse_ok("slaves: [ { name: a } ]\nbus: { presence: any }\n", &cfg);
	CHECK_EQ(cfg.bus_presence, CONFIG_ANY_SLAVES);
}

TEST(config, outputs_have_limits_only_where_given)
{
	static struct config cfg;

	parse_ok("outputs:\n"
		 "  - channel: piccolo0.led\n"
		 "  - { channel: drive.speed, owner: remote, fail_safe: -1.5, min: -2, max: 2e3, "
		 "timeout: 50 }\n",
		 &cfg);
	CHECK_EQ(cfg.output_count, 2);
	CHECK_STR(cfg.output[0].channel, "piccolo0.led");
	CHECK_EQ(cfg.output[0].owner, CONFIG_OWNER_LOCAL);
	CHECK(cfg.output[0].min == -HUGE_VAL && cfg.output[0].max == HUGE_VAL);
	CHECK_EQ(cfg.output[0].line, 2);
	CHECK_EQ(cfg.output[1].owner, CONFIG_OWNER_REMOTE);
	CHECK(cfg.output[1].fail_safe == -1.5 && cfg.output[1].min == -2 &&
	      cfg.output[1].max == 2000);
	CHECK_EQ(cfg.output[1].timeout_ns, 50000000);
}

TEST(config, unknown_keys_are_named_with_a_guess)
{
	parse_fails("cycle:\n  perod: 1ms\n",
		    "t.yaml:2: cycle.perod: unknown option; did you mean cycle.period?");
	parse_fails("\nperiod: 1ms\n",
		    "t.yaml:2: period: unknown option; did you mean cycle.period?");
	parse_fails("cycel:\n  period: 1ms\n",
		    "t.yaml:1: cycel: unknown option; did you mean cycle?");
	parse_fails("slaves:\n- nmae: x\n",
		    "t.yaml:2: slaves[0].nmae: unknown option; did you mean slaves[].name?");
	parse_fails("zzzzzzzz: 1\n", "t.yaml:1: zzzzzzzz: unknown option");
	parse_fails("\"\": 1\n", "t.yaml:1: an empty key");
	parse_fails("slaves[]:\n  name: x\n",
		    "t.yaml:1: slaves[]: unknown option; did you mean slaves?");
	parse_fails("\"a\\nb\\tc\": 1\n", "t.yaml:1: a?b?c: unknown option");
}

TEST(config, wrong_types_are_named)
{
	parse_fails("cycle: 1ms\n", "t.yaml:1: cycle: is a section: expected key: value pairs");
	parse_fails("cycle:\n  period: [ 1ms ]\n",
		    "t.yaml:2: cycle.period: expected one value, not a list");
	parse_fails("cycle:\n  period: { a: 1 }\n",
		    "t.yaml:2: cycle.period: expected a value, not a section");
	parse_fails(
		"cycle:\n  period: fast\n",
		"t.yaml:2: cycle.period: expected a duration such as 500us or 1ms, not \"fast\"");
	parse_fails("cycle:\n  period:\n", "t.yaml:2: cycle.period: has no value");
	parse_fails("cycle:\n  cpu: 1.5\n",
		    "t.yaml:2: cycle.cpu: expected a whole number, not \"1.5\"");
	parse_fails("cycle:\n  cpu: 0x\n",
		    "t.yaml:2: cycle.cpu: expected a whole number, not \"0x\"");
	parse_fails("cycle:\n  phase: half\n",
		    "t.yaml:2: cycle.phase: expected a share such as 50%, not \"half\"");
	parse_fails("dc:\n  kp: nan\n", "t.yaml:2: dc.kp: expected a number, not \"nan\"");
	parse_fails("dc:\n  kp: 0x1p-3\n", "t.yaml:2: dc.kp: expected a number, not \"0x1p-3\"");
	parse_fails("cycle:\n  lock_memory: maybe\n",
		    "t.yaml:2: cycle.lock_memory: expected on or off, not \"maybe\"");
	parse_fails("cycle:\n  poll: busy\n",
		    "t.yaml:2: cycle.poll: expected one of auto|spin|sleep, not \"busy\"");
	parse_fails("record:\n  budget: lots\n",
		    "t.yaml:2: record.budget: expected a size such as 256MiB, not \"lots\"");
	parse_fails("slaves: 2\n",
		    "t.yaml:1: slaves: expected a list: lines that start with \"- \"");
	parse_fails("slaves:\n  - piccolo0\n", "t.yaml:2: slaves[0]: expected key: value pairs");
	parse_fails("- a\n", "t.yaml:1: expected sections: lines such as \"cycle:\"");
	parse_fails("[ a, b ]: 1\n", "t.yaml:1: a key must be a word");
}

TEST(config, wrong_units_are_named)
{
	parse_fails("cycle:\n  period: 1MHz\n",
		    "t.yaml:2: cycle.period: unknown unit \"MHz\": ns, us, ms, s, min, h or d");
	parse_fails("record:\n  budget: 8Gib\n",
		    "t.yaml:2: record.budget: unknown unit \"Gib\": B, KiB, "
		    "MiB, GiB, TiB, kB, MB, GB or TB");
	parse_fails("cycle:\n  cpu: 3cores\n",
		    "t.yaml:2: cycle.cpu: expected a plain number, without \"cores\"");
	parse_fails("dc:\n  lock_cycles: 200ms\n",
		    "t.yaml:2: dc.lock_cycles: unknown unit \"ms\": only cycles");
	parse_fails("cycle:\n  phase: 50ms\n",
		    "t.yaml:2: cycle.phase: unknown unit \"ms\": only %");
	parse_fails("cycle:\n  period: 500000.5ns\n",
		    "t.yaml:2: cycle.period: 500000.5ns is not a whole number of ns");
	parse_fails("cycle:\n  cpu_dma_latency: 500ns\n",
		    "t.yaml:2: cycle.cpu_dma_latency: 500ns is not a whole number of us");
}

TEST(config, values_out_of_range_are_named_with_the_range)
{
	parse_fails("cycle:\n  period: 249999ns\n",
		    "t.yaml:2: cycle.period: 249999ns is out of range: 250us to 10ms");
	parse_fails("cycle:\n  period: 20ms\n",
		    "t.yaml:2: cycle.period: 20ms is out of range: 250us to 10ms");
	parse_fails("cycle:\n  period: -1ms\n",
		    "t.yaml:2: cycle.period: -1ms is out of range: 250us to 10ms");
	parse_fails("cycle:\n  phase: 4.9%\n",
		    "t.yaml:2: cycle.phase: 4.9% is out of range: 5% to 95%");
	parse_fails("cycle:\n  phase: inf\n",
		    "t.yaml:2: cycle.phase: inf is out of range: 5% to 95%");
	parse_fails("cycle:\n  priority: 99\n",
		    "t.yaml:2: cycle.priority: 99 is out of range: 0 to 98");
	parse_fails("slaves:\n- vendor: 0x100000000\n",
		    "t.yaml:2: slaves[0].vendor: 0x100000000 is out of range: 0 to 0xffffffff");
	parse_fails("ring:\n  depth: 99999999999999999999999999h\n",
		    "t.yaml:2: ring.depth: 99999999999999999999999999h is out of range: 1s to 1h");
	parse_fails("slaves:\n- vendor: 0x10000000000000000000000\n",
		    "t.yaml:2: slaves[0].vendor: 0x10000000000000000000000 is out of range: 0 to "
		    "0xffffffff");
	parse_fails("slaves:\n- name: a234567890123456789012345678901x\n",
		    "t.yaml:2: slaves[0].name: is longer than 31 bytes");
	parse_fails("slaves:\n- name: a.b\n",
		    "t.yaml:2: slaves[0].name: expected letters, digits, _ and - "
		    "only, not \"a.b\"");
	parse_fails("record:\n  dir: \"/a\\nb\"\n",
		    "t.yaml:2: record.dir: contains a control character");
	parse_fails("record:\n  dir: \"/a\\0b\"\n",
		    "t.yaml:2: record.dir: contains a control character");
}

TEST(config, duplicate_keys_are_named_with_the_first_line)
{
	parse_fails("cycle:\n  period: 1ms\n  period: 2ms\n",
		    "t.yaml:3: cycle.period: is already set in line 2");
	parse_fails("cycle:\n  period: 1ms\nbus:\ncycle:\n  cpu: 1\n",
		    "t.yaml:4: cycle: is already set in line 1");
	parse_fails("cycle.period: 1ms\ncycle:\n  period: 1ms\n",
		    "t.yaml:3: cycle.period: is already set in line 1");
	parse_fails("slaves:\n- name: a\n  name: b\n",
		    "t.yaml:3: slaves[0].name: is already set in line 2");
}

TEST(config, broken_yaml_is_one_line_with_its_place)
{
	parse_fails("cycle:\n\tperiod: 1ms\n", "t.yaml:2: not YAML: found character that cannot "
					       "start any token while scanning for "
					       "the next token");
	parse_fails("cycle: [ 1\n", "t.yaml:2: not YAML: did not find expected ',' or ']' while "
				    "parsing a flow sequence");
	parse_fails("cycle:\n  cpu: 1\n---\ncycle:\n  cpu: 2\n",
		    "t.yaml:4: more than one YAML document");
	parse_fails("a: *b\n", "t.yaml:1: not YAML: found undefined alias");
}

TEST(config, objects_must_be_whole_and_fit_their_type)
{
	parse_fails("slaves:\n- sdo:\n  - { index: 0x8000, type: UINT }\n",
		    "t.yaml:3: slaves[0].sdo[0].value: is missing");
	parse_fails("slaves:\n- sdo:\n  - { type: UINT, value: 1 }\n",
		    "t.yaml:3: slaves[0].sdo[0].index: is missing");
	parse_fails("slaves:\n- sdo:\n  - index: 0x8000\n    type: UINT\n    value: 70000\n",
		    "t.yaml:5: slaves[0].sdo[0].value: 70000 does not fit into UINT");
	parse_fails("slaves:\n- sdo:\n  - { index: 0x8000, type: UINT, value: x }\n",
		    "t.yaml:3: slaves[0].sdo[0].value: \"x\" is not a valid UINT");
	parse_fails(
		"slaves:\n- sdo:\n  - { index: 0x8000, type: WORD, value: 1 }\n",
		"t.yaml:3: slaves[0].sdo[0].type: expected one of "
		"BOOL|SINT|INT|DINT|LINT|USINT|UINT|UDINT|ULINT|REAL|LREAL|STRING|OCTETS|AUTO, not "
		"\"WORD\"");
	parse_fails("outputs:\n- owner: local\n", "t.yaml:2: outputs[0].channel: is missing");
}

TEST(config, outputs_beside_their_slave_are_those_of_the_list)
{
	static struct config cfg;

	parse_ok("outputs:\n"
		 "  - channel: b.x\n"
		 "slaves:\n"
		 "  - {}\n"
		 "  - outputs:\n"
		 "      - { channel: led, max: 1, owner: remote, timeout: 50 }\n"
		 "      - { channel: speed }\n"
		 "    name: a\n",
		 &cfg);
	CHECK_EQ(cfg.output_count, 3);
	CHECK_STR(cfg.output[0].channel, "b.x");
	CHECK_EQ(cfg.output[0].slave_pos, CONFIG_NO_SLAVE);
	CHECK_STR(cfg.output[1].channel, "a.led");
	CHECK_EQ(cfg.output[1].slave_pos, 1);
	CHECK_EQ(cfg.output[1].line, 6);
	CHECK(cfg.output[1].max == 1 && cfg.output[1].timeout_ns == 50000000);
	CHECK_EQ(cfg.output[1].owner, CONFIG_OWNER_REMOTE);
	CHECK_STR(cfg.output[2].channel, "a.speed");
	CHECK(config_output_find(&cfg, "a.led") == &cfg.output[1]);
	CHECK(config_output_at(&cfg, 1, 1) == &cfg.output[2]);
	CHECK(config_output_at(&cfg, CONFIG_NO_SLAVE, 0) == &cfg.output[0]);
	CHECK(config_output_at(&cfg, CONFIG_NO_SLAVE, 1) == NULL);
}

TEST(config, an_output_is_in_one_list_only_and_its_slave_has_a_name)
{
	static const char long_name[] =
		"slaves:\n- name: a23456789012345678901234567890\n  outputs:\n"
		"  - channel: c2345678901234567890123456789012345\n";

	parse_fails(
		"slaves:\n- name: a\n  outputs:\n  - channel: led\noutputs:\n- channel: a.led\n",
		"t.yaml:6: outputs[].channel: a.led is already in line 4");
	parse_fails(
		"outputs:\n- channel: a.led\nslaves:\n- name: a\n  outputs:\n  - channel: led\n",
		"t.yaml:6: slaves[].outputs[].channel: a.led is already in line 2");
	parse_fails("slaves:\n- outputs:\n  - channel: led\n",
		    "t.yaml:3: slaves[].outputs[].channel: requires slaves[].name");
	parse_fails("slaves:\n- name: a\n  outputs:\n  - { channel: led, min: 1 }\n",
		    "t.yaml:4: slaves[].outputs[].fail_safe: is not within min and max");
	parse_fails("slaves:\n- name: a\n  outputs:\n  - { chanel: led }\n",
		    "t.yaml:4: slaves[0].outputs[0].chanel: unknown option; did you mean "
		    "outputs[].channel?");
	parse_fails("slaves:\n- name: a\n  outputs:\n  - { min: 0 }\n",
		    "t.yaml:4: slaves[0].outputs[0].channel: is missing");
	parse_fails(long_name, "t.yaml:4: slaves[].outputs[].channel: "
			       "a23456789012345678901234567890.c2345678901234567890123456789012345 "
			       "is longer than 63 characters");
}

TEST(config, assign_activate_is_a_word_of_the_esi_or_sii_or_none)
{
	static struct config cfg;

	parse_ok("slaves:\n"
		 "  - {}\n"
		 "  - assign_activate: none\n"
		 "  - assign_activate: sii\n"
		 "  - assign_activate: 0xffff\n",
		 &cfg);
	CHECK_EQ(cfg.slave[0].assign_activate, CONFIG_ASSIGN_SII);
	CHECK_EQ(cfg.slave[1].assign_activate, CONFIG_ASSIGN_NONE);
	CHECK_EQ(cfg.slave[2].assign_activate, CONFIG_ASSIGN_SII);
	CHECK_EQ(cfg.slave[3].assign_activate, 0xffff);
}

TEST(config, channels_belong_to_their_slave_and_start_from_what_the_device_gives)
{
	static struct config cfg;

	parse_ok("slaves:\n"
		 "- channels:\n"
		 "  - match: adc\n"
		 "- name: rear\n"
		 "  channels:\n"
		 "  - { match: 'ai_*', unit: '%', scale: 1e-3, offset: -2, type: INT, min: 0 }\n"
		 "  - { match: 0x6000:01, name: p }\n",
		 &cfg);
	CHECK_EQ(cfg.channel_count, 3);
	CHECK_STR(cfg.channel[0].match, "adc");
	CHECK_EQ(cfg.channel[0].slave_pos, 0);
	CHECK(cfg.channel[0].scale == 0 && cfg.channel[0].offset == 0);
	CHECK(isinf(cfg.channel[0].min) && isinf(cfg.channel[0].max));
	CHECK_EQ(cfg.channel[0].type, CONFIG_CHANNEL_DEVICE);
	CHECK_EQ(cfg.channel[1].slave_pos, 1);
	CHECK_EQ(cfg.channel[1].line, 6);
	CHECK_STR(cfg.channel[1].unit, "%");
	CHECK(cfg.channel[1].scale == 0.001 && cfg.channel[1].offset == -2);
	CHECK_EQ(cfg.channel[1].type, CONFIG_CHANNEL_INT);
	CHECK(cfg.channel[1].min == 0 && isinf(cfg.channel[1].max));
	CHECK_STR(cfg.channel[2].match, "0x6000:01");
	CHECK_STR(cfg.channel[2].name, "p");
}

TEST(config, channels_that_cannot_be_meant_are_refused_with_their_line)
{
	parse_fails("slaves:\n- channels:\n  - { name: x }\n",
		    "t.yaml:3: slaves[0].channels[0].match: is missing");
	parse_fails("slaves:\n- channels:\n  - { match: '' }\n",
		    "t.yaml:3: slaves[].channels[].match: is empty");
	parse_fails("slaves:\n- channels:\n  - { match: a, offset: 1 }\n",
		    "t.yaml:3: slaves[].channels[].offset: requires scale");
	parse_fails("slaves:\n- channels:\n  - { match: a, min: 2, max: 2 }\n",
		    "t.yaml:3: slaves[].channels[].max: is not above min");
	parse_fails("slaves:\n- channels:\n  - { match: a, name: x }\n  - { match: b, name: x }\n",
		    "t.yaml:4: slaves[].channels[].name: x is already used in line 3");
	parse_fails("slaves:\n- channels:\n  - { match: a, name: a.b }\n",
		    "t.yaml:3: slaves[0].channels[0].name: expected letters, digits, _ and - "
		    "only, not \"a.b\"");
	parse_fails("slaves:\n- channels:\n  - { match: a, unit: 0123456789abcdef }\n",
		    "t.yaml:3: slaves[0].channels[0].unit: is longer than 15 bytes");
	parse_fails("slaves:\n- name: n0123456789\n  channels:\n  - { match: a, name: "
		    "x123456789012345678901234567890123456789012345678901 }\n",
		    "t.yaml:4: slaves[].channels[].name: n0123456789.x12345678901234567890123456789"
		    "0123456789012345678901 is longer than 63 characters");
}
