/* SPDX-License-Identifier: MIT */
/* ecdaq log ros2pkg: the message package that `ros2 bag play` needs for a recording. */
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "program/exit_code.h"
#include "record/log.h"
#include "record/log_common.h"
#include "record/mcap_reader.h"
#include "record/messages.h"

enum { TYPES_MOST = 4096, TYPE_BYTES = 128 }; /* what a damaged file can make us create */

struct type {
	char name[TYPE_BYTES]; /* "Piccolo0" */
	char *text;            /* its .msg file */
};

struct package {
	const char *dir;
	FILE *err;
	struct type *type;
	size_t type_count;
};

/* "ecdaq_msgs/msg/Piccolo0": an upper-case letter, then letters and digits, as ROS 2 has it. 1 with
 * the last part in @ret_name. */
static int is_type_of_package(struct mcap_text full, char ret_name[TYPE_BYTES])
{
	static const char prefix[] = MESSAGES_PACKAGE "/msg/";
	const size_t skip = sizeof(prefix) - 1;
	size_t len = full.len > skip ? full.len - skip : 0;

	if (len == 0 || len >= TYPE_BYTES || memcmp(full.at, prefix, skip) != 0) {
		return 0;
	}
	memcpy(ret_name, full.at + skip, len);
	ret_name[len] = '\0';
	return ret_name[0] >= 'A' && ret_name[0] <= 'Z' &&
	       strspn(ret_name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
				"0123456789") == len;
}

/* Without the definitions of nested messages, which are in packages of their own. NULL without
 * memory. */
static char *copy_definition(const struct mcap_item *schema)
{
	char *text = malloc(schema->data_len + 1);
	char *nested;

	if (text == NULL) {
		return NULL;
	}
	memcpy(text, schema->data, schema->data_len);
	text[schema->data_len] = '\0';
	nested = strstr(text, "\n===");
	if (nested != NULL) {
		nested[1] = '\0';
	}
	return text;
}

static int take_schema(struct package *pkg, const struct mcap_item *item, const char *path)
{
	struct type type;
	char why[TYPE_BYTES + 96];

	if (!mcap_text_is(item->encoding, "ros2msg") ||
	    !is_type_of_package(item->name, type.name)) {
		return EXIT_CODE_OK;
	}
	type.text = copy_definition(item);
	if (type.text == NULL) {
		return log_fail_errno(pkg->err, path, -ENOMEM);
	}
	for (size_t i = 0; i < pkg->type_count; i++) {
		if (strcmp(pkg->type[i].name, type.name) == 0) {
			int is_same = strcmp(pkg->type[i].text, type.text) == 0;

			free(type.text);
			snprintf(why, sizeof(why),
				 "defines %s other than a file before: a package for each",
				 type.name);
			return is_same ? EXIT_CODE_OK : log_fail(pkg->err, path, why);
		}
	}
	if (pkg->type_count == TYPES_MOST) {
		free(type.text);
		return log_fail(pkg->err, path, "has too many message types");
	}
	pkg->type[pkg->type_count++] = type;
	return EXIT_CODE_OK;
}

/* The definitions are in front of the first message. */
static int read_schemas(struct package *pkg, struct mcap_reader *reader, const char *path)
{
	struct mcap_item item;
	int result = EXIT_CODE_OK;
	int r;

	while (result == EXIT_CODE_OK && (r = mcap_reader_next(reader, &item)) > 0) {
		if (item.kind == MCAP_ITEM_SCHEMA) {
			result = take_schema(pkg, &item, path);
		} else if (item.kind == MCAP_ITEM_MESSAGE) {
			return result;
		}
	}
	return result == EXIT_CODE_OK && r < 0 ? log_fail_errno(pkg->err, path, r) : result;
}

static int read_file(struct package *pkg, const char *path)
{
	struct mcap_reader *reader;
	struct log_file file;
	int r = log_file_open(path, &file);
	int result;

	if (r < 0) {
		return log_fail_errno(pkg->err, path, r);
	}
	r = mcap_reader_create(&file.source, &reader);
	if (r < 0) {
		log_file_close(&file);
		return log_fail_errno(pkg->err, path, r);
	}
	result = read_schemas(pkg, reader, path);
	mcap_reader_destroy(reader);
	log_file_close(&file);
	return result;
}

static void put_manifest(const struct package *pkg, FILE *out)
{
	(void)pkg;
	fputs("<?xml version=\"1.0\"?>\n"
	      "<package format=\"3\">\n"
	      "  <name>" MESSAGES_PACKAGE "</name>\n"
	      "  <version>" ECDAQ_VERSION "</version>\n"
	      "  <description>Messages of recordings of ecdaq</description>\n"
	      "  <maintainer email=\"ecdaq@example.com\">ecdaq</maintainer>\n"
	      "  <license>MIT</license>\n"
	      "  <buildtool_depend>ament_cmake</buildtool_depend>\n"
	      "  <buildtool_depend>rosidl_default_generators</buildtool_depend>\n"
	      "  <depend>std_msgs</depend>\n"
	      "  <exec_depend>rosidl_default_runtime</exec_depend>\n"
	      "  <member_of_group>rosidl_interface_packages</member_of_group>\n"
	      "  <export>\n"
	      "    <build_type>ament_cmake</build_type>\n"
	      "  </export>\n"
	      "</package>\n",
	      out);
}

static void put_build(const struct package *pkg, FILE *out)
{
	fputs("cmake_minimum_required(VERSION 3.8)\n"
	      "project(" MESSAGES_PACKAGE ")\n"
	      "find_package(ament_cmake REQUIRED)\n"
	      "find_package(std_msgs REQUIRED)\n"
	      "find_package(rosidl_default_generators REQUIRED)\n"
	      "rosidl_generate_interfaces(${PROJECT_NAME}\n",
	      out);
	for (size_t i = 0; i < pkg->type_count; i++) {
		fprintf(out, "  msg/%s.msg\n", pkg->type[i].name);
	}
	fputs("  DEPENDENCIES std_msgs)\n"
	      "ament_export_dependencies(rosidl_default_runtime)\n"
	      "ament_package()\n",
	      out);
}

/* A new file @name of the package: @text, or what @put writes. */
static int write_file(const struct package *pkg, const char *name, const char *text,
		      void (*put)(const struct package *pkg, FILE *out))
{
	char path[PATH_MAX];
	FILE *out;
	int is_bad;

	if (snprintf(path, sizeof(path), "%s/%s", pkg->dir, name) >= (int)sizeof(path)) {
		return log_fail_errno(pkg->err, pkg->dir, -ENAMETOOLONG);
	}
	out = fopen(path, "wxe");
	if (out == NULL) {
		return log_fail(pkg->err, path, strerror(errno));
	}
	if (put != NULL) {
		put(pkg, out);
	} else {
		fputs(text, out);
	}
	is_bad = ferror(out);
	if (fclose(out) != 0 || is_bad) {
		return log_fail(pkg->err, path, strerror(errno));
	}
	return EXIT_CODE_OK;
}

static int make_dir(const struct package *pkg, const char *path)
{
	return mkdir(path, 0777) == 0 ? EXIT_CODE_OK : log_fail(pkg->err, path, strerror(errno));
}

static int write_package(const struct package *pkg)
{
	char name[PATH_MAX];
	int result;

	if (snprintf(name, sizeof(name), "%s/msg", pkg->dir) >= (int)sizeof(name)) {
		return log_fail_errno(pkg->err, pkg->dir, -ENAMETOOLONG);
	}
	result = make_dir(pkg, pkg->dir);
	result = result != EXIT_CODE_OK ? result : make_dir(pkg, name);
	result = result != EXIT_CODE_OK ? result
					: write_file(pkg, "package.xml", NULL, put_manifest);
	result = result != EXIT_CODE_OK ? result
					: write_file(pkg, "CMakeLists.txt", NULL, put_build);
	for (size_t i = 0; i < pkg->type_count && result == EXIT_CODE_OK; i++) {
		snprintf(name, sizeof(name), "msg/%s.msg", pkg->type[i].name);
		result = write_file(pkg, name, pkg->type[i].text, NULL);
	}
	return result;
}

int log_ros2pkg(const char *const *paths, size_t count, const char *dir, FILE *out, FILE *err)
{
	struct package pkg = { .dir = dir, .err = err };
	int result = EXIT_CODE_OK;

	pkg.type = calloc(TYPES_MOST, sizeof(pkg.type[0]));
	if (pkg.type == NULL) {
		return log_fail_errno(err, dir, -ENOMEM);
	}
	for (size_t i = 0; i < count && result == EXIT_CODE_OK; i++) {
		result = read_file(&pkg, paths[i]);
	}
	if (result == EXIT_CODE_OK && pkg.type_count == 0) {
		result = log_fail(err, paths[0], "has no message types of " MESSAGES_PACKAGE);
	}
	result = result != EXIT_CODE_OK ? result : write_package(&pkg);
	if (result == EXIT_CODE_OK) {
		fprintf(out, "%s: package " MESSAGES_PACKAGE ", %zu message types\n", dir,
			pkg.type_count);
		result = log_finish_output(out, err);
	}
	for (size_t i = 0; i < pkg.type_count; i++) {
		free(pkg.type[i].text);
	}
	free(pkg.type);
	return result;
}
