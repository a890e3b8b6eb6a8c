/* SPDX-License-Identifier: MIT */
#include <unistd.h>

#include "bench.h"
#include "esi/library.h"

struct folder {
	char path[32];
	char file[8][64];
	size_t count;
	char bad[4][256];
	size_t bad_count;
};

static struct folder make_folder(void)
{
	struct folder folder = { .path = "/tmp/ecdaq-esi-XXXXXX" };

	CHECK(mkdtemp(folder.path) != NULL);
	return folder;
}

static void put_file(struct folder *folder, const char *name, const char *text)
{
	char path[64];
	FILE *out;

	snprintf(path, sizeof(path), "%s/%s", folder->path, name);
	memcpy(folder->file[folder->count++], path, sizeof(path));
	out = fopen(path, "w");
	CHECK(out != NULL);
	fputs(text, out);
	CHECK_EQ(fclose(out), 0);
}

static void remove_folder(struct folder *folder)
{
	for (size_t i = 0; i < folder->count; i++) {
		unlink(folder->file[i]);
	}
	CHECK_EQ(rmdir(folder->path), 0);
}

static void note_bad(void *ctx, const char *text)
{
	struct folder *folder = ctx;

	snprintf(folder->bad[folder->bad_count++], sizeof(folder->bad[0]), "%s", text);
}

static struct esi_library *read_for(struct folder *folder, const struct esi_identity *wanted,
				    size_t count)
{
	const struct esi_library_report report = { note_bad, folder };
	struct esi_library *library = esi_library_read(folder->path, wanted, count, &report);

	CHECK(library != NULL);
	return library;
}

#define DEVICE(revision, name)                                                                     \
	"<Device><Type ProductCode=\"7\" RevisionNo=\"" #revision "\">" name "</Type></Device>"

TEST(esi_library, revision_that_is_nearest_before_describes_a_device)
{
	const struct esi_identity wanted[] = { { ESI_DEVICE, 0x1337, 7, 3 },
					       { ESI_DEVICE, 0x1337, 7, 5 },
					       { ESI_DEVICE, 0x1337, 7, 1 },
					       { ESI_DEVICE, 0x1337, 7, 9 },
					       { ESI_DEVICE, 0x1337, 8, 3 } };
	struct folder folder = make_folder();
	struct esi_library *library;

	put_file(&folder, "a.XML",
		 BENCH_HEAD DEVICE(5, "five") DEVICE(2, "two") DEVICE(4, "four") BENCH_TAIL);
	library = read_for(&folder, wanted, 5);
	CHECK_EQ(folder.bad_count, 0);
	CHECK_STR(esi_library_find(library, 0x1337, 7, 3)->type, "two");
	CHECK_STR(esi_library_find(library, 0x1337, 7, 5)->type, "five");
	CHECK_STR(esi_library_find(library, 0x1337, 7, 1)->type, "two");
	CHECK_STR(esi_library_find(library, 0x1337, 7, 9)->type, "five");
	CHECK(esi_library_find(library, 0x1337, 8, 3) == NULL);
	esi_library_free(library);
	remove_folder(&folder);
}

TEST(esi_library, bad_file_is_reported_and_the_others_are_read)
{
	const struct esi_identity wanted = { ESI_DEVICE, 0x1337, 7, 3 };
	struct folder folder = make_folder();
	struct esi_library *library;

	put_file(&folder, "a.xml", "<nonsense/>");
	put_file(&folder, "b.xml", BENCH_HEAD DEVICE(3, "b") BENCH_TAIL);
	put_file(&folder, "c.xml", BENCH_HEAD DEVICE(3, "c") BENCH_TAIL);
	put_file(&folder, "readme.txt", "<nonsense/>");
	library = read_for(&folder, &wanted, 1);
	CHECK_EQ(folder.bad_count, 1);
	CHECK(strstr(folder.bad[0], "/a.xml:1: no ESI: <nonsense>") != NULL);
	CHECK_STR(esi_library_find(library, 0x1337, 7, 3)->type, "b");
	esi_library_free(library);
	remove_folder(&folder);
}

TEST(esi_library, folder_that_is_not_there_is_reported)
{
	const struct esi_identity wanted = { ESI_DEVICE, 1, 2, 3 };
	struct folder folder = { .path = "/nonexistent/esi" };
	struct esi_library *library = read_for(&folder, &wanted, 1);

	CHECK_EQ(folder.bad_count, 1);
	CHECK_STR(folder.bad[0], "/nonexistent/esi: No such file or directory");
	CHECK(esi_library_find(library, 1, 2, 3) == NULL);
	esi_library_free(library);
}

TEST(esi_library, a_module_is_found_by_its_vendor_and_ident)
{
	const struct esi_identity wanted[] = { { ESI_DEVICE, 0x1337, 7, 1 },
					       { ESI_MODULE, 0x1337, 7, 0 },
					       { ESI_MODULE, 0x1337, 8, 0 } };
	struct folder folder = make_folder();
	struct esi_library *library;

	put_file(&folder, "a.xml",
		 BENCH_HEAD DEVICE(1, "device") "</Devices><Modules><Module>"
						"<Type ModuleIdent=\"7\">module</Type></Module>"
						"</Modules></Descriptions></EtherCATInfo>");
	library = read_for(&folder, wanted, 3);
	CHECK_EQ(folder.bad_count, 0);
	CHECK_STR(esi_library_find(library, 0x1337, 7, 1)->type, "device");
	CHECK_STR(esi_library_find_module(library, 0x1337, 7)->type, "module");
	CHECK(esi_library_find_module(library, 0x1337, 8) == NULL);
	CHECK(esi_library_find_module(library, 0x1338, 7) == NULL);
	esi_library_free(library);
	remove_folder(&folder);
}
