/* SPDX-License-Identifier: MIT */
#include "bench.h"

#define RICH                                                                                       \
	BENCH_DEVICE(                                                                              \
		"<Name>A &lt;b&gt; &quot;c&quot; "                                                 \
		"&amp;\xc3\xa9</Name><Info><StateMachine><Timeout>"                                \
		"<PreopTimeout>2000</PreopTimeout><SafeopOpTimeout>9</SafeopOpTimeout></Timeout>"  \
		"</StateMachine></Info><GroupType>g</GroupType><Fmmu>Inputs</Fmmu>"                \
		"<Sm DefaultSize=\"8\" StartAddress=\"#x1100\" ControlByte=\"#x64\" "              \
		"Enable=\"1\">Outputs</Sm><RxPdo Fixed=\"1\" Mandatory=\"1\" Sm=\"0\">"            \
		"<Index>#x1600</Index><Name>Out</Name><Exclude>#x1601</Exclude><Entry>"            \
		"<Index>#x7000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><Name>LED</Name>"    \
		"<DataType>BOOL</DataType></Entry><Entry><Index>0</Index><BitLen>7</BitLen>"       \
		"</Entry></RxPdo><Mailbox><AoE/><CoE SdoInfo=\"1\"><InitCmd Fixed=\"1\">"          \
		"<Transition>PS</Transition><Index>#x8000</Index><SubIndex>1</SubIndex>"           \
		"<Data>0aff</Data><Comment>x</Comment></InitCmd></CoE><FoE/></"                    \
		"Mailbox><Dc><OpMode>"                                                             \
		"<Name>DC</Name><Desc>d</Desc><AssignActivate>#x300</AssignActivate>"              \
		"<CycleTimeSync0 Factor=\"2\">7</CycleTimeSync0>"                                  \
		"<ShiftTimeSync0>-5</ShiftTimeSync0></OpMode></Dc>"                                \
		"<Eeprom><ByteSize>2048</ByteSize></Eeprom>")

/* All that is in it, but the line and where lists are. */
static void check_same(const struct esi_device *a, const struct esi_device *b)
{
	struct esi_device one = *a;
	struct esi_device other = *b;

	CHECK_EQ(a->command_count, b->command_count);
	for (size_t i = 0; i < a->command_count; i++) {
		struct esi_command left = a->command[i];
		struct esi_command right = b->command[i];

		CHECK_EQ(left.len, right.len);
		CHECK_MEM(left.data, right.data, left.len);
		left.data = NULL;
		right.data = NULL;
		CHECK_MEM(&left, &right, sizeof(left));
	}
	CHECK_EQ(a->pdo_count, b->pdo_count);
	CHECK_MEM(a->pdo, b->pdo, a->pdo_count * sizeof(*a->pdo));
	CHECK_EQ(a->entry_count, b->entry_count);
	CHECK_MEM(a->entry, b->entry, a->entry_count * sizeof(*a->entry));
	one.line = other.line = 0;
	one.pdo = other.pdo = NULL;
	one.entry = other.entry = NULL;
	one.command = other.command = NULL;
	one.slot = other.slot = NULL;
	CHECK_MEM(&one, &other, sizeof(one));
}

static struct seen read_back(const struct esi_device *const *device, size_t count)
{
	char *text = NULL;
	size_t len = 0;
	FILE *out = open_memstream(&text, &len);
	struct seen seen = { .count = 0 };

	CHECK(out != NULL);
	esi_write(out, device, count);
	CHECK_EQ(fclose(out), 0);
	bench_read(&seen, text, len);
	free(text);
	return seen;
}

TEST(esi_write, written_device_is_read_back_the_same)
{
	struct seen first = bench_text(RICH);
	struct seen second;

	CHECK_EQ(first.result, 0);
	second = read_back((const struct esi_device *const *)first.device, 1);
	CHECK_EQ(second.result, 0);
	CHECK_EQ(second.count, 1);
	check_same(first.device[0], second.device[0]);
	bench_free(&first);
	bench_free(&second);
}

TEST(esi_write, several_devices_are_a_list)
{
	struct seen first = bench_text(RICH);
	const struct esi_device *twice[] = { first.device[0], first.device[0] };
	struct seen second = read_back(twice, 2);

	CHECK_EQ(second.result, 0);
	CHECK_EQ(second.count, 2);
	check_same(first.device[0], second.device[1]);
	bench_free(&first);
	bench_free(&second);
}
