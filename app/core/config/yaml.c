/* SPDX-License-Identifier: MIT */
/* ecdaq.yaml: from the file to a YAML document; walk.c reads its contents. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <yaml.h>

#include "config/config.h"
#include "config/walk.h"

enum { FILE_LIMIT_BYTES = 1 << 20 };

static int fail_syntax(struct walk *walk, const yaml_parser_t *parser)
{
	char why[OPTION_WHY_BYTES];

	if (parser->error == YAML_MEMORY_ERROR) {
		walk_fail(walk, 0, "", "out of memory");
		return -ENOMEM;
	}
	snprintf(why, sizeof(why), "not YAML: %s%s%s",
		 parser->problem == NULL ? "?" : parser->problem,
		 parser->context == NULL ? "" : " ",
		 parser->context == NULL ? "" : parser->context);
	return walk_fail(walk, (int)parser->problem_mark.line + 1, "", why);
}

/* The first document of @parser into @walk->cfg; a second one is an error. */
static int read_documents(struct walk *walk, yaml_parser_t *parser)
{
	yaml_document_t doc;
	yaml_document_t next;
	int r;

	if (!yaml_parser_load(parser, &doc)) {
		return fail_syntax(walk, parser);
	}
	walk->doc = &doc;
	r = walk_document(walk);
	if (r == 0 && yaml_document_get_root_node(&doc) != NULL) {
		if (!yaml_parser_load(parser, &next)) {
			r = fail_syntax(walk, parser);
		} else {
			const yaml_node_t *root = yaml_document_get_root_node(&next);

			if (root != NULL) {
				r = walk_fail(walk, (int)root->start_mark.line + 1, "",
					      "more than one YAML document");
			}
			yaml_document_delete(&next);
		}
	}
	yaml_document_delete(&doc);
	return r;
}

/* The contents of a file. */
struct contents {
	const char *name;
	const char *text;
	size_t text_len;
};

static int parse(const struct contents *contents, const struct config_source *source,
		 struct config *cfg, char *error, size_t error_bytes)
{
	struct config work;
	struct walk walk = { .name = contents->name,
			     .cfg = &work,
			     .set = source->set,
			     .set_count = source->set_count,
			     .watch = source,
			     .error = error,
			     .error_bytes = error_bytes };
	yaml_parser_t parser;
	int r;

	if (contents->text_len > FILE_LIMIT_BYTES) {
		walk_fail(&walk, 1, "", "larger than 1 MiB");
		return -E2BIG;
	}
	config_defaults(&work);
	snprintf(work.path, sizeof(work.path), "%s", contents->name);
	if (!yaml_parser_initialize(&parser)) {
		walk_fail(&walk, 0, "", "out of memory");
		return -ENOMEM;
	}
	yaml_parser_set_input_string(&parser, (const unsigned char *)contents->text,
				     contents->text_len);
	r = read_documents(&walk, &parser);
	yaml_parser_delete(&parser);
	if (r == 0) {
		*cfg = work;
	}
	return r;
}

int config_parse(const char *name, const char *text, size_t text_len, struct config *cfg,
		 char *error, size_t error_bytes)
{
	const struct contents contents = { .name = name, .text = text, .text_len = text_len };

	return parse(&contents, &(struct config_source){ .path = name }, cfg, error, error_bytes);
}

/* All of @fd, at most one byte more than allowed. Length or -errno. */
static ssize_t read_all(int fd, char *buf, size_t capacity)
{
	size_t len = 0;

	while (len < capacity) {
		ssize_t n = read(fd, buf + len, capacity - len);

		if (n < 0 && errno == EINTR) {
			continue;
		}
		if (n < 0) {
			return -errno;
		}
		if (n == 0) {
			break;
		}
		len += (size_t)n;
	}
	return (ssize_t)len;
}

static int load(const struct config_source *source, struct config *cfg, char *error,
		size_t error_bytes)
{
	static char text[FILE_LIMIT_BYTES + 1]; /* a program reads its file once, before its threads
						 */
	struct contents contents = { .name = source->path, .text = text };
	ssize_t len = -1;
	int fd = open(source->path, O_RDONLY | O_CLOEXEC);
	int r = fd < 0 ? -errno : 0;

	if (fd >= 0) {
		len = read_all(fd, text, sizeof(text));
		r = len < 0 ? (int)len : 0;
		close(fd);
	}
	if (r < 0) {
		snprintf(error, error_bytes, "%s: cannot read the configuration: %s", source->path,
			 strerror(-r));
		return r;
	}
	contents.text_len = (size_t)len;
	return parse(&contents, source, cfg, error, error_bytes);
}

int config_load(const char *path, struct config *cfg, char *error, size_t error_bytes)
{
	return load(&(struct config_source){ .path = path }, cfg, error, error_bytes);
}

int config_assemble_from(const struct config_source *source, struct config *cfg, char *error,
			 size_t error_bytes)
{
	struct walk walk = { .cfg = cfg,
			     .set = source->set,
			     .set_count = source->set_count,
			     .watch = source,
			     .error = error,
			     .error_bytes = error_bytes };

	if (source->path != NULL) {
		return load(source, cfg, error, error_bytes);
	}
	config_defaults(cfg);
	return walk_finish(&walk);
}

int config_assemble(const char *path, const char *const *set, size_t set_count, struct config *cfg,
		    char *error, size_t error_bytes)
{
	return config_assemble_from(
		&(struct config_source){ .path = path, .set = set, .set_count = set_count }, cfg,
		error, error_bytes);
}
